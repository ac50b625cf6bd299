"""Slips of laboratory files that would give a plausible wrong number: each is read right or refused with its cause."""

from pathlib import Path

import numpy as np
import pytest
from strip_reading import read_lab

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import said_by
from knittest.experiment.lab_strips import plausible_strips

BODY = "Weg;Kraft\nmm;N\n0,0;0,0\n1,0;2000,5\n3,0;6400,0\n"


def written(tmp_path, text, name="export.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize(
    "head",
    [
        "Strip width;100;mm",
        "Strip width [mm];100",
        "Strip width,100,mm".replace(",", ";"),
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
def test_the_width_of_the_head_is_found(tmp_path, head, encoding):
    text = f"Zwick\n{head}\nKlemmenbreite;60;mm\nBackenbreite: 60 mm\nEinspannlänge;200\n{BODY}"
    path = written(tmp_path, text, encoding=encoding)
    (specimen,) = read_lab(path)
    assert specimen.width == pytest.approx(100.0) and specimen.gauge == 200.0
    assert read_lab(path, width=100.0)[0].width == pytest.approx(100.0)
    with pytest.raises(InputError, match=r"export\.csv:2: strip width 100 mm, but --width is 50 mm"):
        read_lab(path, width=50.0)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("Strip width;100;ft", "unit 'ft'"),
        ("Strip width;0,1", r"implausible, expected 5 to 1000 mm \(it looks like m: 100 mm\)"),
        ("Strip width;100;mm\nProbenbreite;50;mm", ":2: strip width 50 mm, but .*:1 states 100 mm; keep"),
        ("Breite;100;mm;Breite;50;mm", "strip width 50 mm, but"),
    ],
)
def test_widths_that_cannot_be_are_refused(tmp_path, head, words):
    with pytest.raises(InputError, match=words):
        read_lab(written(tmp_path, f"{head}\n{BODY}"), 200.0)


@pytest.mark.parametrize("head", ["Bandbreite;100;Hz", "Roll width;1500;mm", "Breite", "b0;;", "Klemmenbreite;60;mm"])
def test_no_other_width_is_taken_for_that_of_the_strip(tmp_path, head):
    assert read_lab(written(tmp_path, f"{head}\n{BODY}"), 200.0)[0].width is None
    assert read_lab(written(tmp_path, f"{head}\n{BODY}"), 200.0, width=25.0)[0].width == 25.0
    with pytest.raises(InputError, match=r"--width 0\.05: implausible.*it looks like m: 50 mm"):
        read_lab(written(tmp_path, BODY), 200.0, width=0.05)


def test_widths_in_columns_belong_to_their_specimens(tmp_path):
    text = "Weg;Kraft;Breite;Weg;Kraft;Breite\nmm;N;cm;mm;N;mm\n0;0;10;0;0;99\n1;10;10;1;20;\n"
    assert [s.width for s in read_lab(written(tmp_path, text), 200.0)] == [100.0, 99.0]
    one = "Weg;Kraft;Weg;Kraft;Breite\n0;0;0;0;50\n1;10;1;20;\n"
    assert [s.width for s in read_lab(written(tmp_path, one), 200.0)] == [50.0, 50.0]
    for bad, words in (
        (text.replace("10;10;1;20", "10;9;1;20"), ":4: strip width 90 mm, but"),
        ("Breite;80\n" + one, "strip width 50 mm, but .*:1 states 80 mm"),
        (one.replace("50", ""), "column 'Breite' is empty; remove it and give --width"),
        (
            "Breite;" + "Weg;Kraft;" * 3 + "Breite\n" + "50;0;0;0;0;0;0;50\n50;1;1;1;1;1;1;50\n",
            "2 columns of strip width",
        ),
    ):
        with pytest.raises(InputError, match=words):
            read_lab(written(tmp_path, bad), 200.0)


@pytest.mark.parametrize("travel", ["1;3", "-1;-3"])
def test_a_pull_that_is_counted_negative_is_asked_for(tmp_path, travel):
    first, second = travel.split(";")
    path = written(tmp_path, f"Weg;Kraft\n0;-1,2\n{first};-2000\n{second};-6400\n")
    if first == "1":
        with pytest.raises(
            InputError, match=r"force from -1\.2 to -6400 N, but tension counts as positive.*--sign neg"
        ):
            read_lab(path, 200.0)
    (turned,) = read_lab(path, 200.0, sign="negative")
    assert list(turned.force) == [1.2, 2000.0, 6400.0] and list(turned.strain) == [0.0, 0.5, 1.5]
    usual = written(tmp_path, "Weg;Kraft\n0;-1,2\n1;2000\n3;6400\n")  # noise below zero is none
    assert read_lab(usual, 200.0)[0].force[0] == -1.2
    with pytest.raises(InputError, match=r"force from 6400 to -1\.2 N, but tension counts as negative.*--sign posit"):
        read_lab(usual, 200.0, sign="negative")


@pytest.mark.parametrize(
    ("unit", "force", "words"),
    [
        ("kN", "6400", r"6\.4e\+06 N, 1\.28e\+05 N/mm at 50 mm width: implausible, expected 25 to 150000 N \("),
        ("N", "6,4", r"6\.4 N, 0\.128 N/mm at 50 mm width: implausible, .*it looks like kN: 6400 N or daN: 64 N"),
        ("N", "0,0", "maximum force 0 N"),
    ],
)
def test_a_force_in_the_wrong_unit_is_refused_with_the_likely_one(tmp_path, unit, force, words):
    path = written(tmp_path, f"Weg;Kraft\nmm;{unit}\n0;0\n3,5;{force}\n")
    with pytest.raises(InputError, match=words):
        plausible_strips(read_lab(path, 200.0, width=50.0))


def test_forces_of_yarns_and_strains_are_judged_too(tmp_path):
    plausible_strips(read_lab(written(tmp_path, "Weg;Kraft\nmm;N\n0;0\n3,5;6,4\n"), 200.0))
    for text, words in (
        ("Weg;Kraft\nmm;kN\n0;0\n3,5;3200\n", r"3\.2e\+06 N: implausible, .*it looks like N: 3200 N or daN: 32000 N"),
        ("Dehnung [%];Kraft\n0;0\n0,016;3200\n", r"strain at maximum force 0\.016 %.*it looks like a fraction: 1\.6 %"),
        ("Weg;Kraft\nmm;N\n0;0\n150;3200\n", r"strain at maximum force 75 %: implausible, expected 0\.1 to 50 %"),
    ):
        with pytest.raises(InputError, match=words):
            plausible_strips(read_lab(written(tmp_path, text), 200.0))


def test_the_specimen_in_another_unit_is_named(tmp_path):
    files = {"a": "5,8", "b": "6,1", "c": "0,59", "d": "6,0"}
    series = [
        s
        for name, force in files.items()
        for s in read_lab(written(tmp_path, f"Weg;Kraft [kN]\n0;0\n3,5;{force}\n", f"{name}.csv"), 200.0, width=50.0)
    ]
    with pytest.raises(
        InputError, match=r"c\.csv: specimen c: maximum force 590 N and the median of the other 3, 6000 N"
    ):
        plausible_strips(series)
    plausible_strips([s for s in series if s.name != "c"])
    long = read_lab(written(tmp_path, "Weg [cm];Kraft [kN]\n0;0\n3,5;6\n", "e.csv"), 200.0, width=50.0)
    with pytest.raises(
        InputError, match=r"e\.csv: specimen e: strain at maximum force 17\.5 % and the median of the other 3"
    ):
        plausible_strips([*(s for s in series if s.name != "c"), *long])


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
    found = said_by(Path(name), [(1, head.split(";"))])
    assert (found.direction if found else "") == said


def test_a_force_that_is_none_at_all_is_no_pull(tmp_path):
    (still,) = read_lab(written(tmp_path, "Weg;Kraft\n0;0\n1;0\n"), 200.0)
    assert not np.any(still.force)


@pytest.mark.parametrize(
    "name", ["force_n_per_50mm", "Kraft pro 50 mm", "force per 5 cm", "force per width", "line load", "Linienkraft"]
)
def test_a_force_that_is_not_that_of_the_whole_strip_is_refused(tmp_path, name):
    """A strip 100 mm wide whose force is given for 50 mm would come out half as strong."""
    path = written(tmp_path, f"Probenbreite;100;mm\nEinspannlänge;200\n{BODY.replace('Kraft', name)}")
    with pytest.raises(InputError, match="is a force per width; expected the force of the whole strip"):
        read_lab(path)


@pytest.mark.parametrize("name", ["force [N]", "force per yarn [N]", "process load"])
def test_names_that_only_look_like_a_force_per_width_are_read(tmp_path, name):
    path = written(tmp_path, f"Probenbreite;100;mm\nEinspannlänge;200\n{BODY.replace('Kraft', name)}")
    assert read_lab(path)[0].force.max() == 6400.0


def test_two_forces_over_one_travel_are_not_two_strips(tmp_path):
    """A filtered copy of the force would count as a second specimen, with no scatter."""
    path = written(
        tmp_path,
        "Breite;50;mm\nEinspannlänge;200\nWeg;Kraft;Kraft gefiltert\nmm;N;N\n0;0;0\n1;2000;1990\n3;6400;6390\n",
    )
    with pytest.raises(InputError, match="'Kraft' and 'Kraft gefiltert' share the column 'Weg'"):
        read_lab(path)
