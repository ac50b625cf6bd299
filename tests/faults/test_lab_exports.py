"""Files as testing machines write them, of all tests: the right numbers, or the reason why not, for each kind."""

import random
import re

import numpy as np
import pytest
from machine_exports import HEAD, PEAK, REJECTED, RIGHT, SIZES, STRAIN, TRAVEL, B, E, Export, F, lines, text, workbook
from machine_workbook import XLS
from strip_reading import refused

from knittest.base.errors import InputError
from knittest.cli.main import run
from knittest.experiment.lab_tests import LAB_TESTS, read_files
from knittest.experiment.statistics import peaks
from knittest.materials.trellis import crosshead, crosshead_of_normalised

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
#: what is no test of one strip: test, export, words of the message
NOT_ONE = {
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
ONE |= {**RIGHT, "xls workbook": lambda: Export(XLS, "kette 1.xls")}
THREE |= {kind: (export, [50.0]) for kind, export in ONE.items()}
ROUGH = {"rows at rest with noise": 0.02, "noise in the travel": 0.02, "extensometer sampled slower": 0.11}
NOT_ONE |= {kind: ("tensile", export, words) for kind, (export, words) in REJECTED.items()}


@pytest.mark.parametrize("kind", THREE)
def test_force_strain_and_width_of_the_specimens_of_a_file_are_right(tmp_path, kind):
    make, widths = THREE[kind]
    export = make()
    specimens = read_files("tensile", [export.written(tmp_path)], export.said or {})
    force, strain = peaks(specimens)
    one = kind in ONE
    assert force == pytest.approx([PEAK] if one else FORCES, rel=1e-3)
    assert strain == pytest.approx([STRAIN] if one else STRAINS, rel=ROUGH.get(kind, 1e-3))
    assert [specimen.width for specimen in specimens] == widths


@pytest.mark.parametrize("kind", NOT_ONE)
def test_what_is_no_test_of_one_strip_is_rejected_with_its_name(tmp_path, kind):
    name, export, words = NOT_ONE[kind]
    path = export().written(tmp_path)
    with pytest.raises(InputError, match=words) as rejected:
        LAB_TESTS[name].results(read_files(name, [path], SIZES if kind in REJECTED else {}))
    assert str(rejected.value).startswith(str(path))


def test_the_output_names_the_columns_that_count_and_why_others_do_not(tmp_path, capsys):
    path = RIGHT["extensometer slipped"]().written(tmp_path)
    assert run(["data", "import", str(path), "--direction", "warp", "--out", str(tmp_path / "mine")]) == 0
    said = capsys.readouterr().out
    assert "columns used: 'Force [N]' (force), 'Travel [mm]' (clamp travel, gauge length 200 mm)" in said
    assert (
        "columns not used: 'Extensometer [mm]' (extensometer travel, gauge length 100 mm: its strain falls from" in said
    )


def test_the_option_that_a_message_prints_reads_the_file(tmp_path, capsys):
    path = text(lines(["Kanal A", "Kanal B"], B), name="a.csv").written(tmp_path)
    assert run(["data", "stats", str(path)]) == 2
    assert '--column force="Kanal A" --column travel="Kanal B"' in capsys.readouterr().err
    assert run(["data", "stats", str(path), "--column", "force=Kanal A", "--column", "travel=Kanal B"]) == 0
    assert run(["data", "stats", str(path), "--column", "force=Kanal X"]) == 2
    assert "--column names 'kanal x', which the file does not have" in capsys.readouterr().err
    assert run(["data", "stats", str(path), "--column", "power=Kanal A"]) == 2
    assert "expected ROLE=NAME, ROLE one of" in capsys.readouterr().err


@pytest.mark.parametrize("seed", range(6))
def test_a_damaged_workbook_is_read_or_refused(tmp_path, seed):
    """The reader of workbooks may end its own process, or ask for any memory."""
    draw, raw = random.Random(seed), bytearray(XLS)
    for place in draw.sample(range(len(raw)), 40):
        raw[place] = draw.randrange(256)
    path = Export(bytes(raw[: 5000 if seed == 0 else None]), "a.xls").written(tmp_path)
    try:
        assert read_files("tensile", [path], {})
    except InputError as error:
        assert str(error).startswith(str(path))


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


GAMMA = np.deg2rad(np.linspace(0.0, 45.0, 91))
WAY = np.array([crosshead(gamma, 200.0) for gamma in GAMMA])
FRAME = crosshead_of_normalised(0.1 * GAMMA / np.cos(GAMMA), GAMMA, 180.0, 200.0)
TIME = 0.5 * np.arange(len(GAMMA))
FRAME_HEAD = [["Frame side", "200", "mm"], ["Fabric side", "180", "mm"]]
KPA = np.geomspace(0.5, 500.0, 40)
THICK = 3.0 - 0.2 * np.log10(KPA)
PLATE = np.pi * 25.0**2 * 1e-3  # N per kPa of a plate of 50 mm
PULL = np.linspace(0.0, 50.0, 201)
MU = np.where(PULL < 2.0, 0.06 * PULL, 0.1)
PLATES = [["Normal force", "2000", "N"], ["Plate length", "150", "mm"], ["Plate width", "50", "mm"]]
WAYS = np.linspace(0.0, 30.0, 100)
BIAS = 5.0 * (WAYS / 30.0) ** 2
BIAS_HEAD = [["Specimen width", "100", "mm"], ["Gauge length", "200", "mm"]]
STRIPS = {"area_mass": 830.0, "width": 25.0}


def overhangs(name, *labels):
    rows = [["", name], ["1", "165"], ["2", "163"], ["3", "170"], *([label, "166"] for label in labels)]
    return text([["Nr", name], *rows[1:]])


# fmt: off
#: test, what is special: file, options
FILES = {
    ("picture-frame", "stroke"): (lambda: text(lines(
        ["Time", "Stroke", "Force"], (TIME, WAY, FRAME), ["s", "mm", "N"], FRAME_HEAD)), {}),
    ("picture-frame", "force before stroke"): (lambda: text(lines(
        ["Time", "Force", "Stroke"], (TIME, FRAME, WAY), ["s", "N", "mm"], FRAME_HEAD)), {}),
    ("picture-frame", "two frames"): (lambda: text(lines(
        ["Time", "Force", "Displacement"] * 2, (TIME, FRAME, WAY, TIME, FRAME * 1.0001, WAY), ["s", "N", "mm"] * 2,
        FRAME_HEAD)), {}),
    ("picture-frame", "polish angle"): (lambda: text(lines(
        ["Kąt ścinania [°]", "Siła [N]"], (np.rad2deg(GAMMA), FRAME),
        head=[["Bok ramy", "200", "mm"], ["Bok tkaniny", "180", "mm"]]), ";", ",", "cp1250"), {}),
    ("picture-frame", "workbook"): (lambda: workbook({
        "Parameter": [["Rahmenlänge", "200", "mm"], ["Gewebeseite", "180", "mm"]],
        "Werte": lines(["Weg", "Kraft"], (WAY, FRAME), ["mm", "N"], [])}), {}),
    ("picture-frame", "no header"): (lambda: text(lines([], (TIME, WAY, FRAME), head=[])[1:]),
        {"columns": "time,travel,force", "frame_side": 200.0, "fabric_side": 180.0}),
    ("compaction", "bar"): (lambda: text(lines(["Thickness [mm]", "Pressure [bar]"], (THICK, KPA / 100.0), head=[])),
        {}),
    ("compaction", "psi"): (lambda: text(lines(["Gap [in]", "Pressure [psi]"], (THICK / 25.4, KPA / 6.894757),
        head=[])), {}),
    ("compaction", "force and plate"): (lambda: text(lines(["Dicke [mm]", "Kraft [N]"], (THICK, KPA * PLATE),
        head=[["Plattendurchmesser", "5", "cm"]])), {}),
    ("compaction", "force and option"): (lambda: text(lines(["Épaisseur (mm)", "Force (N)"], (THICK, KPA * PLATE),
        head=[]), ";", ",", "cp1252"), {"plate_diameter": 50.0}),
    ("friction", "coefficient"): (lambda: text(lines(["Travel [mm]", "Coefficient of friction"], (PULL, 2.0 * MU),
        head=PLATES)), {}),
    ("friction", "reibzahl"): (lambda: text(lines(["Weg [mm]", "Reibzahl"], (PULL, 2.0 * MU),
        head=[["Normalkraft", "2", "kN"], ["Plattenlänge", "150", "mm"], ["Plattenbreite", "50", "mm"]]),
        ";", ","), {}),
    ("friction", "normal force in a column"): (lambda: text(lines(
        ["Travel [mm]", "Normal force [N]", "Friction force [N]"], (PULL, 0.0 * PULL + 2000.0, 4000.0 * MU),
        head=PLATES[1:])), {}),
    ("bias-extension", "strain"): (lambda: text(lines(["Strain [%]", "Load [N]"], (WAYS / 2.0, BIAS), head=BIAS_HEAD)),
        {}),
    ("bias-extension", "chinese strain"): (lambda: text(lines(["应变(mm/mm)", "载荷(N)"], (WAYS / 200.0, BIAS),
        head=[["试样宽度", "100", "mm"], ["夹持距离", "200", "mm"]]), encoding="gb18030"), {}),
    ("cantilever", "english"): (lambda: overhangs("Overhang [mm]", "Mean", "CV [%]", "Std. Dev.", "n"), STRIPS),
    ("cantilever", "german"): (lambda: overhangs("Überhang [mm]", "Mittelwert", "Max", "Min", "Spannweite"), STRIPS),
    ("cantilever", "french"): (lambda: overhangs("Porte-à-faux [mm]", "Moyenne", "Écart-type"), STRIPS),
    ("cantilever", "polish"): (lambda: overhangs("Zwis [mm]", "Średnia", "Odchylenie standardowe"), STRIPS),
    ("cantilever", "chinese"): (lambda: overhangs("悬垂长度 [mm]", "平均值", "标准差", "变异系数"), STRIPS),
    ("cantilever", "japanese"): (lambda: overhangs("張り出し長さ [mm]", "平均", "標準偏差"), STRIPS),
    ("cantilever", "spanish"): (lambda: overhangs("Voladizo [mm]", "Media", "Desviación estándar"), STRIPS),
    ("cantilever", "italian"): (lambda: overhangs("Sbalzo [mm]", "Media", "Deviazione standard"), STRIPS),
    ("cantilever", "faces in columns"): (lambda: text([["Specimen", "Overhang A [mm]", "Overhang B [mm]"],
        ["1", "160", "170"], ["2", "163", "163"], ["3", "175", "165"]]), STRIPS),
    ("cantilever", "workbook"): (lambda: workbook({"S": [["Specimen", "Overhang [mm]"], ["1", "165"], ["2", "163"],
        ["3", "170"], ["Mean", "166"], ["SD", "3.6"]]}), STRIPS),
}
# fmt: on
#: column of the result, and its values
EXPECTED = {
    "picture-frame": ("10 deg [N]", float(np.interp(np.deg2rad(10.0), GAMMA, FRAME)), 3e-3),
    "compaction": ("100 kPa [mm]", 2.6, 1e-3),
    "friction": ("of a face", 0.1, 1e-3),
    "cantilever": ("overhang [mm]", [165.0, 163.0, 170.0], 1e-9),
}


def shown(test, path, options):
    """Columns of the table that is printed, by their heads."""
    table = LAB_TESTS[test].lines(read_files(test, [path], options))
    heads, *rows = (re.split(r"\s{2,}", line.strip()) for line in table)
    values = [row[1:] for row in rows[: next(k for k, row in enumerate(rows) if row[0] == "mean")]]
    return dict(zip(heads[1:], np.array(values, float).T, strict=True))


@pytest.mark.parametrize(("test", "kind"), FILES)
def test_the_result_is_right(tmp_path, test, kind):
    export, options = FILES[test, kind]
    found = shown(test, export().written(tmp_path), options)
    if test == "bias-extension":  # as of the same test with an extension in mm
        same = text(lines(["Extension [mm]", "Load [N]"], (WAYS, BIAS), head=BIAS_HEAD), name="same.csv")
        assert found["20 deg [N]"] == pytest.approx(shown(test, same.written(tmp_path), {})["20 deg [N]"], rel=1e-4)
        return
    head, value, tolerance = EXPECTED[test]
    assert np.shape(found[head]) == np.shape(value) or not np.shape(value)
    assert found[head] == pytest.approx(np.broadcast_to(value, np.shape(found[head])), rel=tolerance)


def test_columns_that_name_no_overhang_are_listed_with_the_option(tmp_path):
    rows = [["Specimen", "A face up [mm]"], ["1", "165"], ["2", "163"]]
    path = text(rows).written(tmp_path)
    refused(r'--column overhang="A face up \[mm\]"', read_files, "cantilever", [path], STRIPS)
    strips = read_files("cantilever", [path], STRIPS | {"column": ('overhang="A face up [mm]"',)})
    assert [strip.overhang for strip in strips] == [165.0, 163.0]


def test_a_force_on_a_plate_of_unknown_size_is_no_pressure(tmp_path):
    path = text(lines(["Thickness [mm]", "Force [N]"], (THICK, KPA), head=[])).written(tmp_path)
    refused(r"states no plate diameter: give --plate-diameter \[mm\]", read_files, "compaction", [path], {})
