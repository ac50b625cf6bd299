"""Explanations of the parts of a report for a newcomer, as ``knittest demo`` shows them."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from knittest.report_page.blocks import Cell, Page, Section, Table, Text

START = (
    "This page shows a virtual tensile test. knittest simulated how a strip of a knitted fabric with straight "
    "reinforcing yarns (inlays) is pulled until it breaks. The grey boxes explain each part of the page. Reports of "
    "other commands look the same, without the boxes.",
    "A strip was simulated with two models. The macro model sees the fabric as a sheet of shell elements: it is fast, "
    "and a forming simulation of a whole part needs it. The meso model sees each yarn as a chain of beam elements that "
    "touch each other: it is slower, and shows which yarn breaks.",
    "The strips are shorter than those of the laboratory, and that of the meso model is narrower, so that the example "
    "takes seconds. The measured force is scaled to the width of the strip.",
)
#: explanation of a section, by its anchor without the number of the run
GUIDE = {
    "overview": "One row for each run, with its state. A run is finished when it says so and its quality checks "
    "passed.",
    "comparison": "Results of both models next to each other. The curves show the force that pulls the strip over its "
    "strain (elongation by original length). The force rises until yarns break, then it falls. The mark with bars is "
    "the experiment: mean peak force and mean fracture strain, with one standard deviation. The paper publishes no "
    "whole curve.",
    "differences": "All settings in which the two runs differ. solver.safety is the share of the largest stable time "
    "step that is used.",
    "run": "From here on, the page describes one run after the other. First: how the run ended.",
    "run-results": "Each row compares one number with the experiment. The deviation is given in standard deviations "
    "(sd) of the experiment: between -1 sd and +1 sd, the simulation lies within the scatter of the laboratory. The "
    "kind says what an agreement is worth: a predicted row tests the model, a tuned row was used to fit it, an input "
    "was put into it.",
    "run-curve": "The curve of this run alone. It is stored in curve.csv, which any spreadsheet opens.",
    "run-pictures": "The deformed specimen at failure, and the energies over time. The loading is slow enough "
    "(quasi-static) if the kinetic energy stays far below the work that the clamps do. The energy error shows whether "
    "the sum of all energies equals this work: a large one means a wrong calculation.",
    "run-gates": "Each run has to pass these checks before knittest compares it with an experiment. A failed check "
    "means that the numbers above cannot be trusted, however well they agree. Damping, contact damping and hourglass "
    "are energies that only the calculation takes up. Penetration and overlap say how far yarns pass into each other. "
    "Added mass allows longer time steps. Beyond the end of a law: share of elements that are strained further than "
    "the input curve. Uncertain in time: how well the moment of the peak is known. The relaxed fabric is the meso "
    "model before the clamps move: its thickness, and the tension and wrap of its loops, which press on each other. "
    "Its accuracy follows from the forces that are not yet in balance. The energies list where the work of the clamps "
    "goes, by yarn system and mechanism. The cost is computing time and number of time steps.",
    "run-studies": "Known effects of numerical settings, such as the speed of the clamps, on this test.",
    "run-parameters": "All inputs with their sources. Measured values come from the paper, assumed ones are guesses "
    "that you may have to replace for your own fabric. The preset sets the size of the elements, from quick to paper.",
    "run-repeat": "The command, the complete settings and the versions: anyone can repeat the run from them.",
}
#: title of the first section; the last one has the commands to try next
TITLE, NEXT = "What this page shows", "Where to go next"
#: commands after the example
COMMANDS = {
    "knittest tensile --variant {fabric}": "the full tensile test in both directions, a minute or more",
    "knittest picture-frame --variant {fabric} --scale macro": "shear the fabric in a picture frame",
    "knittest view {folder}/meso": "turn the yarns and play the test in a browser",
    "knittest new mine": "write a fabric file with comments, to describe a fabric of your own",
    "knittest --help": "list all tests and studies",
}


def explain(page: Page, fabric: str, folder: str) -> Page:
    """``page`` with explanations: what was tested, one for each part, and commands for the ``folder`` of the runs."""
    rows = [(Cell(command.format(fabric=fabric, folder=folder)), Cell(what)) for command, what in COMMANDS.items()]
    first = Section("guide", TITLE, [Text(text) for text in START], level=2)
    last = Section("next", NEXT, [Table("Commands to try", ("command", "what it does"), rows)], level=2)
    return replace(page, sections=[first, *_explained(page.sections), last])


def _explained(sections: Sequence[Section]) -> Iterator[Section]:
    """``sections`` with the explanation of each kind of section where it comes first."""
    left = dict(GUIDE)
    for section in sections:
        kind = "-".join(part for part in section.anchor.split("-") if not part.isdigit())
        text = left.pop(kind, "")
        yield replace(section, blocks=[Text(text, "help"), *section.blocks]) if text else section
