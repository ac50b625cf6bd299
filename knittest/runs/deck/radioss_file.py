"""Writes a prepared specimen as the starter and the engine file of OpenRadioss: NAME_0000.rad and NAME_0001.rad.

The starter has /BEGIN (units g, mm, ms) and /TITLE, then the parts of :mod:`knittest.runs.deck.radioss_parts`. The
engine has /RUN, /VERS, /DT or, for yarns, /DT/NODA, whose nodal time step counts the stiffness of contacts, /TFILE/3
(time history as text), /ANIM, /PRINT and /MON.
"""

from pathlib import Path

from knittest.base.errors import InputError
from knittest.base.files import write_atomic
from knittest.config.run import Run
from knittest.export.blocks import REAL, VERSION, BlockFile
from knittest.export.keywords import number
from knittest.laboratory.base import PreparedSpecimen
from knittest.models.boundary import Boundary
from knittest.models.fabric_model import FabricModel
from knittest.models.yarn_model import YarnModel
from knittest.runs.deck.deck_file import check_test, head_lines
from knittest.runs.deck.differences import deck_differences
from knittest.runs.deck.radioss_parts import add_history, add_motions, add_sheet, add_yarn_contact, add_yarns

#: what is known of decks for OpenRadioss
KNOWN = (
    "NOT RUN BY KNITTEST: this file was parsed back and compared with the model, and its columns with the reader's.",
    "Decks for LS-DYNA ran in OpenRadioss after a conversion to these keywords: strips of shells and of yarns.",
)
FORCE = (
    "reactions of the nodes in /TH/NODE/1, which are impulses: force is their derivative; knittest compare RUN "
    "--against {name}T01 reads them"
)
#: cycles between lines of the log
PRINTED = 1000


def write_radioss(folder: Path, name: str, run: Run, prepared: PreparedSpecimen) -> tuple[list[Path], list[str]]:
    """Write the starter and engine file of ``prepared``; returns both paths and the differences from the model.

    Raises :class:`InputError` for a test without such a deck, :class:`ResourceError` if a file cannot be written.
    Clamps the model, which must not be run afterwards.
    """
    starter, engine, missing = radioss_of(name, run, prepared)
    paths = [folder / f"{name}_000{k}.rad" for k in range(2)]
    for path, text in zip(paths, (starter.text(), engine), strict=True):
        write_atomic(path, text)
    return paths, missing


def radioss_of(name: str, run: Run, prepared: PreparedSpecimen) -> tuple[BlockFile, str, list[str]]:
    """Starter, text of the engine file and differences from the model; see :func:`write_radioss`."""
    check_test(run, "openradioss")
    missing = deck_differences(run, prepared, "openradioss")
    model, rig, damping = prepared.model, prepared.rig, run.solver.damping_per_ms
    deck = BlockFile(["#RADIOSS STARTER"])
    deck.comment(*head_lines(run, prepared, missing, KNOWN, FORCE.format(name=name)))
    _add_begin(deck, name, f"{run.rig.kind} of {run.fabric.name}, {run.model.scale}")
    boundary = Boundary(model, run.solver.safety * model.critical_step)
    if isinstance(model, YarnModel):
        parts = add_yarns(deck, model)
        if model.contact:
            add_yarn_contact(deck, model, parts)
    else:
        assert isinstance(model, FabricModel)
        add_sheet(deck, model)
    rig.constrain(boundary)
    moved = add_motions(deck, model, boundary.drive(), boundary.tables, rig.duration, damping)
    add_history(deck, moved)
    return deck, _engine(name, run, prepared), missing


def _add_begin(deck: BlockFile, name: str, title: str) -> None:
    if len(name) > 80:
        raise InputError(f"name of the deck: {name}: expected at most 80 characters")
    deck.block("BEGIN", name)
    deck.card("Invers Irun", VERSION, 0)
    for system in ("Input", "Work"):
        deck.card(f"{system}_mass:20 {system}_length:20 {system}_time:20", "g", "mm", "ms")
    deck.block("TITLE", title)


def _engine(name: str, run: Run, prepared: PreparedSpecimen) -> str:
    """Text of the engine file."""
    end = prepared.rig.duration
    sample, frame = (number(end / n, REAL) for n in (run.output.samples, max(run.output.frames, 1)))
    step = "/DT/NODA" if isinstance(prepared.model, YarnModel) else "/DT"
    lines = (
        "#RADIOSS ENGINE", f"/RUN/{name}/1", number(end, REAL), f"/VERS/{VERSION}", step, f"{run.solver.safety:g} 0",
        "/TFILE/3", sample, "/ANIM/DT", f"0 {frame}", "/ANIM/ELEM/ENER", f"/PRINT/-{PRINTED}", "/MON/ON",
    )  # fmt: skip
    return "\n".join([*lines, ""])
