"""Exports of strips from testing machines: the right numbers, or a refusal with row and cause; never a traceback."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from strip_reading import read_lab, refused

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import find_direction
from knittest.experiment.lab_strips import check_strips
from knittest.experiment.statistics import corridor, peaks

GERMAN = "Prüfprotokoll;Zwick Z100\n\nWeg;Kraft\nmm;kN\n0,0;0,0\n1,0;1,25\n2,0;3,5\n"
BODY = "Weg;Kraft\nmm;N\n0,0;0,0\n1,0;2000,5\n3,0;6400,0\n"
ENCODINGS = ["utf-8", "utf-8-sig", "utf-16", "cp1252"]


@pytest.fixture
def written(tmp_path):
    """Writes a file of an export."""

    def write(text, name="export.csv", encoding="utf-8"):
        (tmp_path / name).write_bytes(text.encode(encoding))
        return tmp_path / name

    return write


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_german_export_with_unit_row(written, encoding):
    (specimen,) = read_lab(written(GERMAN, encoding=encoding), gauge_length=200.0)
    assert specimen.strain == pytest.approx([0.0, 0.5, 1.0])
    assert specimen.force == pytest.approx([0.0, 1250.0, 3500.0])


def test_several_specimens_side_by_side(written):
    text = "Weg;Kraft;Weg;Kraft\nmm;N;mm;N\n0;0;0;0\n1;10;1;20\n2;40;2;50\n;;3;90\n"
    one, two = read_lab(written(text), 100.0)
    assert (len(one.strain), len(two.strain)) == (3, 4)
    assert [list(values) for values in peaks([one, two])] == [[40.0, 90.0], [2.0, 3.0]]
    band = corridor([one, two])  # all specimens count everywhere
    sd = np.std([40.0, 50.0], ddof=1)
    assert (band.strain[-1], band.mean[-1], band.sd[-1]) == pytest.approx((2.0, 45.0, sd))


@pytest.mark.parametrize(
    ("head", "newton", "percent"),
    [
        ("Weg;Kraft", 1.0, 0.05),
        ("Weg;Kraft\nmm;daN", 10.0, 0.05),
        ("Weg [cm];Kraft [lbf]", 4.4482216, 0.5),
        ("Weg in mm;Kraft (Aufnehmer 1) [kgf]", 9.80665, 0.05),
        ("Weg / m;Kraft / KN", 1000.0, 50.0),
        ("travel, inch;force, mN", 0.001, 1.27),
        ("weg_um;force_cn", 0.01, 5e-5),
        ("Weg µm;Kraft N", 1.0, 5e-5),
        ("strain_pct;force_n", 1.0, 0.1),
        ("Dehnung [mm/mm];Kraft", 1.0, 10.0),
        ("Strain [%];Force (cN)", 0.01, 0.1),
        *((f"Weg;{name}", 1.0, 0.05) for name in ("force [N]", "force per yarn [N]", "process load")),
    ],
)
def test_units_of_force_and_travel(written, head, newton, percent):
    (specimen,) = read_lab(written(f"{head}\n0;0\n0.1;1\n"), 200.0)
    assert (specimen.force[1], specimen.strain[1]) == pytest.approx((newton, percent))


NAMES = ("force_n_per_50mm", "Kraft pro 50 mm", "force per 5 cm", "force per width", "line load", "Linienkraft")
#: text and words of the message
REFUSED = [
    ("Weg;Kraft\nmm;MPa\n0;0\n1;1\n", ":2: column 'Kraft' has the unit 'MPa'; expected one of N, kN, daN"),
    (
        "Weg [ft];Kraft\n0;0\n1;1\n",
        r":1: column 'Weg \[ft\]' has the unit 'ft'; expected one of mm, cm, m, um, inch, %",
    ),
    ("Weg;Kraft in MN\n0;0\n1;1\n", "unit 'MN'"),
    ("Weg;Kraft [kN]\nmm;N\n0;0\n1;1\n", "states another unit, 'N'"),
    ("Dehnung;Kraft\n0;0\n1;1\n", "has no unit of strain"),
    ("Weg;Kraft\n0;0\n1.234;5\n2.345;6\n", "--decimal"),
    ("Weg;Kraft\n0;0\n1;abc\n", ":3: 'abc'"),
    ("Weg;Kraft\n0;0\n2;5\n1;6\n", ":4: "),
    ("Weg;Kraft\n0;0\n1;nan\n", ":3: 'nan'"),
    ("Weg;Kraft\n0;0\n", "at least two"),
    ("a;b\n0;0\n1;1\n", "no header row names"),
    ("Weg;Kraft\n0;0\n1;2\n;\n3\n", ""),
    ("", "no header row names"),
    ("Weg [m];Kraft\n0;0\n1,5;1\n3,5;2\n", "gives a strain of 1750 %, above the limit of 100 %"),
    ("L0;0,2\n" + BODY, r"L0 0.2: implausible.* \(it looks like m: 200 mm\)"),
    ("L0;9;ft\n" + BODY, "unit 'ft'"),
    ("Strip width;100;ft\n" + BODY, "unit 'ft'"),
    ("Strip width;0,1\n" + BODY, r"implausible, expected 5 to 1000 mm \(it looks like m: 100 mm\)"),
    ("Strip width;100;mm\nProbenbreite;50;mm\n" + BODY, ":2: strip width 50 mm, but .*:1 states 100 mm; keep"),
    ("Breite;100;mm;Breite;50;mm\n" + BODY, "strip width 50 mm, but"),
    # a strip 100 mm wide whose force is given for 50 mm would come out half as strong
    *((BODY.replace("Kraft", name), "is a force per width; expected the force of the whole strip") for name in NAMES),
    # a filtered copy of the force would count as a second specimen, with no scatter
    ("Weg;Kraft;Kraft gefiltert\nmm;N;N\n0;0;0\n1;2000;1990\n", "'Kraft' and 'Kraft gefiltert' share the column 'Weg'"),
]


@pytest.mark.parametrize(("text", "words"), REFUSED)
def test_refused_with_the_row_and_the_cause(written, text, words):
    refused(rf"export\.csv.*{words}", read_lab, written(text), 200.0)


@pytest.mark.parametrize(
    "row",
    ['"Einspannlänge";"200,00";"mm"', "Gauge length: 20 cm", "L0 [m];0.2", "Einspannlänge bei Beginn;200"],
)
def test_the_gauge_length_of_the_head_is_used_and_may_be_repeated(written, row):
    path = written(f"Zwick\n{row}\nWeg;Kraft\n0,0;0,0\n1,0;1,25\n")
    for length in (None, 200.0):
        assert read_lab(path, length)[0].strain[-1] == pytest.approx(0.5)
    refused(r":2: gauge length 200 mm, but --gauge-length is 100 mm", read_lab, path, 100.0)


def test_no_or_an_implausible_gauge_length(written):
    path = written("Weg;Kraft\n0;0\n1,5;1\n3,5;2\n")
    refused("give --gauge-length", read_lab, path)
    refused(r"--gauge-length 0.2: implausible, expected 5 to 2000 mm \(it looks like m: 200 mm\)", read_lab, path, 0.2)
    read_lab(written("Dehnung [%];Kraft\n0;0\n1,5;1\n3,5;2\n"))  # a strain needs no gauge length


def test_binary_and_missing_files(tmp_path):
    path = tmp_path / "x.csv"
    path.write_bytes(b"\x00\x01\x02Weg;Kraft")
    for bad in (path, tmp_path / "missing.csv"):
        refused(bad.name, read_lab, bad, 200.0)


@settings(max_examples=150, deadline=2000, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.one_of(
        st.binary(max_size=300),
        st.lists(st.lists(st.text('0123456789.,;-eE naWegKraft\t"', max_size=8), max_size=5), max_size=8).map(
            lambda rows: "\n".join(["Weg;Kraft", *(";".join(r) for r in rows)]).encode()
        ),
    )
)
def test_any_bytes_are_read_or_refused(tmp_path, content):
    path = tmp_path / "fuzz.csv"
    path.write_bytes(content)
    try:
        for specimen in read_lab(path, 200.0):
            assert np.isfinite(specimen.force).all()
            assert (np.diff(specimen.strain) > 0).all()
    except InputError:
        pass


@pytest.mark.parametrize("encoding", ENCODINGS)
@pytest.mark.parametrize(
    "head",
    [
        "Strip width;100;mm",
        "Strip width [mm];100",
        "Breite: 100,0 mm",
        "Breite b0 = 100 mm",
        "Probenbreite;10,0;cm",
        "Probenbreite [cm];10",
        "Specimen width / mm;100",
        "width of the specimen;0,1;m",
        "b0;100",
        "b [mm];100",
        "# strip_width_mm: 100",
        "Probe;Prüfling 1;Streifenbreite;100;mm;Dicke;2,2;mm",
        "Streifenbreite;100;Dicke;2,2",
        "Breite;100;mm\nBreite b0;100,2;mm",
    ],
)
def test_the_width_of_the_head_is_found(written, head, encoding):
    text = f"Zwick\n{head}\nKlemmenbreite;60;mm\nBackenbreite: 60 mm\nEinspannlänge;200\n{BODY}"
    path = written(text, encoding=encoding)
    (specimen,) = read_lab(path)
    assert specimen.width == pytest.approx(100.0) and specimen.gauge == 200.0
    assert read_lab(path, width=100.0)[0].width == pytest.approx(100.0)
    refused(r"export\.csv:2: strip width 100 mm, but --width is 50 mm", read_lab, path, width=50.0)


@pytest.mark.parametrize("head", ["Bandbreite;100;Hz", "Roll width;1500;mm", "Breite", "b0;;", "Klemmenbreite;60;mm"])
def test_no_other_width_is_taken_for_that_of_the_strip(written, head):
    path = written(f"{head}\n{BODY}")
    assert read_lab(path, 200.0)[0].width is None and read_lab(path, 200.0, width=25.0)[0].width == 25.0
    refused(r"--width 0\.05: implausible.*it looks like m: 50 mm", read_lab, path, 200.0, width=0.05)


def test_widths_in_columns_belong_to_their_specimens(written):
    text = "Weg;Kraft;Breite;Weg;Kraft;Breite\nmm;N;cm;mm;N;mm\n0;0;10;0;0;99\n1;10;10;1;20;\n"
    assert [s.width for s in read_lab(written(text), 200.0)] == [100.0, 99.0]
    one = "Weg;Kraft;Weg;Kraft;Breite\n0;0;0;0;50\n1;10;1;20;\n"
    assert [s.width for s in read_lab(written(one), 200.0)] == [50.0, 50.0]
    three = "Breite;" + "Weg;Kraft;" * 3 + "Breite\n" + "50;0;0;0;0;0;0;50\n50;1;1;1;1;1;1;50\n"
    for bad, words in (
        (text.replace("10;10;1;20", "10;9;1;20"), ":4: strip width 90 mm, but"),
        ("Breite;80\n" + one, "strip width 50 mm, but .*:1 states 80 mm"),
        (one.replace("50", ""), "column 'Breite' is empty; remove it and give --width"),
        (three, "2 columns of strip width"),
    ):
        refused(words, read_lab, written(bad), 200.0)


@pytest.mark.parametrize(("first", "second"), [("1", "3"), ("-1", "-3")])
def test_a_pull_that_is_counted_negative_is_asked_for(written, first, second):
    path = written(f"Weg;Kraft\n0;-1,2\n{first};-2000\n{second};-6400\n")
    if first == "1":
        refused(r"force from -1\.2 to -6400 N, but tension counts as positive.*--sign neg", read_lab, path, 200.0)
    (turned,) = read_lab(path, 200.0, sign="negative")
    assert list(turned.force) == [1.2, 2000.0, 6400.0] and list(turned.strain) == [0.0, 0.5, 1.5]
    usual = written("Weg;Kraft\n0;-1,2\n1;2000\n3;6400\n")  # noise below zero is none
    assert read_lab(usual, 200.0)[0].force[0] == -1.2
    words = r"force from 6400 to -1\.2 N, but tension counts as negative.*--sign posit"
    refused(words, read_lab, usual, 200.0, sign="negative")


@pytest.mark.parametrize(
    ("table", "width", "words"),
    [
        ("mm;kN\n0;0\n3,5;6400", 50.0, r"1\.28e\+05 N/mm at 50 mm width: implausible, expected 25 to 150000 N \("),
        ("mm;N\n0;0\n3,5;6,4", 50.0, r"0\.128 N/mm at 50 mm .*it looks like kN: 6400 N or daN: 64 N"),
        ("mm;N\n0;0\n3,5;0,0", 50.0, "maximum force 0 N"),
        ("mm;kN\n0;0\n3,5;3200", None, r"3\.2e\+06 N: implausible, .*it looks like N: 3200 N or daN: 32000 N"),
        ("%;N\n0;0\n0,016;3200", None, r"strain at maximum force 0\.016 %.*it looks like a fraction: 1\.6 %"),
        ("mm;N\n0;0\n150;3200", None, r"strain at maximum force 75 %: implausible, expected 0\.1 to 50 %"),
    ],
)
def test_an_implausible_force_or_strain_is_refused_with_the_likely_unit(written, table, width, words):
    check_strips(read_lab(written("Weg;Kraft\nmm;N\n0;0\n3,5;6,4\n"), 200.0))  # a yarn
    specimens = read_lab(written(f"Weg;Kraft\n{table}\n"), 200.0, width=width)
    refused(words, check_strips, specimens)


def test_the_specimen_in_another_unit_is_named(written):
    files = {"a": "mm 5,8", "b": "mm 6,1", "c": "mm 0,59", "d": "mm 6,0", "e": "cm 6"}
    a, b, c, d, e = (
        read_lab(written(f"Weg [{unit}];Kraft [kN]\n0;0\n3,5;{force}\n", f"{name}.csv"), 200.0, width=50.0)[0]
        for name, (unit, force) in ((name, text.split()) for name, text in files.items())
    )
    check_strips([a, b, d])
    refused(
        r"c\.csv: specimen c: maximum force 590 N and the median of the other 3, 6000 N", check_strips, [a, b, c, d]
    )
    words = r"e\.csv: specimen e: strain at maximum force 17\.5 % and the median of the other 3"
    refused(words, check_strips, [a, b, d, e])


@pytest.mark.parametrize(
    ("name", "head", "said"),
    [
        ("lab/weft-1.csv", "", "weft"),
        ("lab/probe_schuss_3.csv", "", "weft"),
        ("lab/Kettrichtung 2.csv", "", "warp"),
        ("lab/1.csv", "Prüfrichtung;Kette", "warp"),
        ("lab/1.csv", "direction: course", "weft"),
        ("lab/warp-1.csv", "Richtung: Schussrichtung", "weft"),
        ("weft/1.csv", "", "weft"),
        ("lab/1.csv", "Biaxial weft-knitted fabric with inlays", ""),
        ("lab/1.csv", "warp and weft", ""),
        ("lab/1.csv", "Verkettung der Crosslinks; swept; Kettler", ""),
        ("lab/warp-1.csv", "Biaxiales Kettengewirk, Schuss und Kette", "warp"),
    ],
)
def test_the_direction_that_a_file_states(name, head, said):
    found = find_direction(Path(name), [(1, head.split(";"))])
    assert (found.direction if found else "") == said


def test_a_force_that_is_none_at_all_is_no_pull(written):
    (still,) = read_lab(written("Weg;Kraft\n0;0\n1;0\n"), 200.0)
    assert not np.any(still.force)
