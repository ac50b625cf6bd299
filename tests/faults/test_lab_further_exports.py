"""Further exports of testing machines: several specimens in a file, slips of extensometers, names, units."""

import numpy as np
import pytest
from machine_exports import HEAD, PEAK, STRAIN, TRAVEL, B, E, F, lines, text, workbook
from strip_reading import refused

from knittest.experiment.lab_tests import LAB_TESTS, read_files
from knittest.experiment.statistics import peaks

FORCES, STRAINS = [1.1 * PEAK, PEAK, 0.9 * PEAK], [1.2 * STRAIN, STRAIN, 0.8 * STRAIN]
NAMES = ["Force [N]", "Displacement [mm]"]
GERMAN = [["Probenbreite", "50", "mm"], ["Einspannlänge", "200", "mm"]]
FRENCH = [["Largeur éprouvette", "50", "mm"]]
POLISH = [["Szerokość próbki", "50", "mm"], ["Odległość między uchwytami", "200", "mm"]]
OWN = [*HEAD, ["Extensometer gauge length", "100", "mm"]]
TABLE = lines(NAMES, B)


def third(k):
    """Force and travel of specimen ``k`` of three, the strongest first."""
    return F * FORCES[k] / PEAK, TRAVEL * STRAINS[k] / STRAIN


def with_return(k):
    """The same, and the travel comes back after the fracture."""
    force, travel = third(k)
    return np.append(force, np.zeros(20)), np.append(travel, np.linspace(travel[-1], 0.0, 20))


def cell(row, column, value):
    """Rows of text with another ``value`` in a cell of the table, counted from its end."""
    rows = [list(cells) for cells in TABLE]
    rows[-row][column] = value
    return rows


def headed(*head, names=NAMES, columns=B):
    return text(lines(names, columns, head=[*HEAD, *map(list, head)]))


# fmt: off
#: one specimen of 7,000 N at 1.6 %, 50 mm wide
ONE = {
    "extensometer slips slowly": lambda: text(lines(
        ["Force [N]", "Travel [mm]", "Strain 1 [%]"], (F, TRAVEL, np.minimum(E, 0.57 * STRAIN + 0.05 * E))
    )),
    "extensometer sampled slower": lambda: text(lines(
        ["Force [N]", "Travel [mm]", "Strain 1 [%]"],
        [np.repeat(c, 3) for c in (F, 1.3 * TRAVEL, E[np.arange(len(E)) // 6 * 6])],
    )),
    "video extensometer": lambda: text(lines(["Force (N)", "Displacement (mm)", "AVE 2 (%)"], (F, 1.3 * TRAVEL, E))),
    "corrected travel": lambda: text(lines([*NAMES, "Corrected displacement [mm]"], (F, 1.3 * TRAVEL, TRAVEL))),
    "mean of two sensors": lambda: text(lines(
        ["Force [N]", "Travel [mm]", "Strain 1 [%]", "Strain 2 [%]", "Mean strain [%]"],
        (F, TRAVEL, 1.2 * E, 0.8 * E, E),
    )),
    "a force in percent beside one in newtons": lambda: text(lines(
        ["Force [%]", "Load [N]", "Travel [mm]"], (F / 70.0, F, TRAVEL)
    )),
    "clamps of a chinese machine": lambda: text(lines(
        ["夹头位移(mm)", "位移(mm)", "力(N)"], (1.3 * TRAVEL, TRAVEL, F),
        head=[["试样宽度", "50", "mm"], ["夹持距离", "200", "mm"]],
    )),
    "italian article, extensometer without its length": lambda: text(lines(
        ["Forza [N]", "Spostamento [mm]", "Estensimetro [mm]"], (F, TRAVEL, 0.25 * TRAVEL),
        head=[["Larghezza provino", "50", "mm"], ["Distanza tra le ganasce", "200", "mm"]],
    )),
    "channels in brackets": lambda: text(lines(
        ["Load", "Displacement", "Tensile strain (Displacement)", "Tensile strain (Strain 1)"],
        (F, 1.3 * TRAVEL, 1.3 * E, E), ["(N)", "(mm)", "(%)", "(%)"],
    )),
    "verschiebung": lambda: text(lines(["Kraft", "Verschiebung"], B, ["N", "mm"], GERMAN), encoding="cp1252"),
    "extensión": lambda: text(lines(["Carga", "Extensión", "Deformación (Extensión)"], (*B, E), ["N", "mm", "%"])),
    "course standard": lambda: text(lines(
        ["Force standard", "Course standard"], B, ["N", "mm"], [*FRENCH, ["L0 - course standard", "200", "mm"]]
    )),
    "french without marks": lambda: text(lines(
        ["Force", "Deplacement"], B, ["N", "mm"],
        [["Largeur eprouvette", "50", "mm"], ["Distance entre machoires", "200", "mm"]],
    )),
    "polish in iso 8859-2": lambda: text(lines(
        ["Siła", "Przemieszczenie"], B, ["N", "mm"], POLISH), encoding="iso8859-2"),
    "short names": lambda: text(lines(["Load [N]", "Disp [mm]"], B)),
    "channel of an extensometer": lambda: text(lines(
        ["Kraft[kN]", "Ext1[mm]", "Weg[mm]"], (F / 1e3, E, 1.3 * TRAVEL), head=OWN
    )),
    "units as words": lambda: text(lines(["Load (newtons)", "Position (millimeters)"], B)),
    "overflow in a cell": lambda: text(cell(30, 0, "Overflow")),
    "dates and decimal commas": lambda: text([
        *GERMAN, ["Datum", "Kraft [N]", "Weg [mm]"], *(["27.10.2026 ", *row] for row in TABLE[3:])
    ], decimal=","),
    "numbers as text in a workbook": lambda: workbook({"Werte": [
        [f"{float(v):,.3f}".translate(str.maketrans(",.", ".,")) for v in row] if row[0][0].isdigit() else row
        for row in TABLE
    ]}),
    "sizes above a table of results": lambda: text([
        GERMAN[0], ["Einspannlänge:", "200,00 mm"], ["Probe", "Fmax", "Dehnung bei Fmax"], ["", "N", "%"],
        ["1", "7000", "1.6"], *lines(["Kraft [N]", "Weg [mm]"], B, head=[]),
    ], decimal=","),
}
#: three specimens of FORCES and STRAINS, and their widths
THREE = {
    "a column numbers them": (lambda: text([
        *HEAD, ["Specimen", *NAMES],
        *([str(k + 1), *row] for k in range(3) for row in lines(NAMES, third(k), head=[])[1:]),
    ]), [50.0] * 3),
    "each with a width of its own": (lambda: text([
        row for k in range(3)
        for row in lines(NAMES, third(k), head=[["Specimen width", f"{50 + 0.4 * k:g}", "mm"], HEAD[1]])
    ]), [50.0, 50.4, 50.8]),
    "each with a return stroke": (lambda: text([
        *HEAD, *(row for k in range(3) for row in lines(NAMES, with_return(k), head=[]))
    ]), [50.0] * 3),
}
CYCLES = [np.tile(np.append(c[:41], back * c[40::-1]), 3) for c, back in ((F, 0.8), (TRAVEL, 1.0))]
#: what is no pull of one strip: test, export, words of the message
REJECTED = {
    "cycles of one amplitude": ("tensile", lambda: headed(columns=CYCLES), "the force rises again"),
    "specimens without a mark between them": (
        "tensile", lambda: headed(columns=np.hstack([third(k) for k in range(3)])), "several specimens",
    ),
    "shear of a joint": ("tensile", lambda: headed(("Test method", "Lap shear strength ISO 4587")), "shear"),
    "short beam": ("tensile", lambda: headed(("Title", "Interlaminar shear strength, short beam")), "flexure|shear"),
    "seam": ("tensile", lambda: headed(("Prüfart", "Nahtfestigkeit ISO 13935-1")), "seam"),
    "grab": ("tensile", lambda: headed(("Test method", "Grab test ISO 13934-2")), "grab"),
    "tear by its standard": ("tensile", lambda: headed(("Test standard", "ISO 13937-2")), "tear"),
    "peel of layers": ("tensile", lambda: headed(("Prüfvorschrift", "Trennkraft DIN 54310")), "peel"),
    "two axes": (
        "biaxial", lambda: headed(("Strain ratio", "1"), names=[f"{n} {a} {u}" for a in "XY" for n, u in
        (("Force", "[N]"), ("Displacement", "[mm]"))], columns=(*B, 0.8 * F, TRAVEL)), "of two directions",
    ),
    "travel of an inner length": (
        "bias-extension", lambda: text(lines(
            ["Standard force [N]", "Standard travel [mm]"], (F / 10.0, 10.0 * TRAVEL),
            head=[["Specimen width", "100", "mm"], HEAD[1], ["Gauge length, standard travel", "100", "mm"]],
        )), "gauge length of 100 mm",
    ),
}
# fmt: on


@pytest.mark.parametrize("kind", ONE)
def test_force_and_strain_of_a_specimen(tmp_path, kind):
    specimens = read_files("tensile", [ONE[kind]().written(tmp_path)], {})
    force, strain = peaks(specimens)
    assert force == pytest.approx([PEAK], rel=1e-3)
    assert strain == pytest.approx([STRAIN], rel=0.11 if "sampled" in kind else 1e-3)
    assert specimens[0].width == 50.0


@pytest.mark.parametrize("kind", THREE)
def test_specimens_of_a_file_are_parted(tmp_path, kind):
    export, widths = THREE[kind]
    specimens = read_files("tensile", [export().written(tmp_path)], {})
    force, strain = peaks(specimens)
    assert force == pytest.approx(FORCES, rel=1e-3)
    assert strain == pytest.approx(STRAINS, rel=1e-3)
    assert [specimen.width for specimen in specimens] == widths


@pytest.mark.parametrize("kind", REJECTED)
def test_other_tests_are_rejected(tmp_path, kind):
    name, export, words = REJECTED[kind]
    refused(words, lambda: LAB_TESTS[name].results(read_files(name, [export().written(tmp_path)], {})))


@pytest.mark.parametrize(
    ("names", "statistics"),
    [("ANS", []), ("123", ["Mean", "s", "V [%]", "Coef. of Var."])],
    ids=["letters name strips", "letters of statistics"],
)
def test_letters_name_strips_or_statistics(tmp_path, names, statistics):
    rows = [["Area mass", "830", "g/m2"], ["Specimen", "Overhang [mm]"]]
    rows += [[name, value] for name, value in zip(names, ["165", "161", "170.5"], strict=True)]
    path = text([*rows, *([label, "2.5"] for label in statistics)]).written(tmp_path)
    found = LAB_TESTS["cantilever"].results(read_files("cantilever", [path], {})).found
    assert found["overhang_mm"] == pytest.approx([165.0, 161.0, 170.5])
