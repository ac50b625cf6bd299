"""Testing-machine exports: what must be read right, and what must be refused with rows (never a traceback)."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from strip_reading import read_lab

from knittest.base.errors import InputError
from knittest.experiment.statistics import corridor, peaks


def write(tmp_path, text, encoding="utf-8", name="export.csv"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


GERMAN = "Prüfprotokoll;Zwick Z100\n\nWeg;Kraft\nmm;kN\n0,0;0,0\n1,0;1,25\n2,0;3,5\n"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_german_export_with_unit_row(tmp_path, encoding):
    (specimen,) = read_lab(write(tmp_path, GERMAN, encoding), gauge_length=200.0)
    assert specimen.strain == pytest.approx([0.0, 0.5, 1.0])
    assert specimen.force == pytest.approx([0.0, 1250.0, 3500.0])


def test_units_in_brackets_and_strain_in_percent(tmp_path):
    text = "Strain [%],Force (cN)\n0,0\n0.5,100\n1.5,300\n"
    (specimen,) = read_lab(write(tmp_path, text), 200.0)
    assert specimen.strain == pytest.approx([0.0, 0.5, 1.5])
    assert specimen.force == pytest.approx([0.0, 1.0, 3.0])


def test_several_specimens_side_by_side(tmp_path):
    text = "Weg;Kraft;Weg;Kraft\nmm;N;mm;N\n0;0;0;0\n1;10;1;20\n2;40;2;50\n;;3;90\n"
    one, two = read_lab(write(tmp_path, text), 100.0)
    assert (len(one.strain), len(two.strain)) == (3, 4)
    force, strain = peaks([one, two])
    assert list(force) == [40.0, 90.0]
    assert list(strain) == [2.0, 3.0]
    band = corridor([one, two])
    assert band.strain[-1] == pytest.approx(2.0)  # all specimens count everywhere
    assert band.mean[-1] == pytest.approx(45.0)
    assert band.sd[-1] == pytest.approx(np.std([40.0, 50.0], ddof=1))


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
    ],
)
def test_units_of_force_and_travel(tmp_path, head, newton, percent):
    (specimen,) = read_lab(write(tmp_path, f"{head}\n0;0\n0.1;1\n"), 200.0)
    assert specimen.force[1] == pytest.approx(newton)
    assert specimen.strain[1] == pytest.approx(percent)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("Weg;Kraft\nmm;MPa", ":2: column 'Kraft' has the unit 'MPa'; expected one of N, kN, daN"),
        ("Weg [ft];Kraft", ":1: column 'Weg [ft]' has the unit 'ft'; expected one of mm, cm, m, um, inch, %"),
        ("Weg;Kraft in MN", "unit 'MN'"),
        ("Weg;Kraft [kN]\nmm;N", "states another unit, 'N'"),
        ("Dehnung;Kraft", "has no unit of strain"),
    ],
)
def test_unknown_units_are_refused(tmp_path, head, words):
    with pytest.raises(InputError, match=r"export\.csv") as caught:
        read_lab(write(tmp_path, f"{head}\n0;0\n1;1\n"), 200.0)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    "row",
    ['"Einspannlänge";"200,00";"mm"', "Gauge length: 20 cm", "L0 [m];0.2", "Einspannlänge bei Beginn;200"],
)
def test_the_gauge_length_of_the_head_is_used_and_may_be_repeated(tmp_path, row):
    path = write(tmp_path, f"Zwick\n{row}\nWeg;Kraft\n0,0;0,0\n1,0;1,25\n")
    for length in (None, 200.0):
        assert read_lab(path, length)[0].strain[-1] == pytest.approx(0.5)
    with pytest.raises(InputError, match=r":2: gauge length 200 mm, but --gauge-length is 100 mm"):
        read_lab(path, 100.0)


def test_no_or_implausible_gauge_lengths(tmp_path):
    text = "Weg;Kraft\n0;0\n1,5;1\n3,5;2\n"
    for head, length, words in (
        ("", None, "give --gauge-length"),
        ("", 0.2, r"--gauge-length 0.2: implausible, expected 5 to 2000 mm \(it looks like m: 200 mm\)"),
        ("L0;0,2\n", None, r"L0 0.2: implausible.* \(it looks like m: 200 mm\)"),
        ("L0;9;ft\n", None, "unit 'ft'"),
    ):
        with pytest.raises(InputError, match=words):
            read_lab(write(tmp_path, head + text), length)
    with pytest.raises(InputError, match="gives a strain of 1750 %, above the limit of 100 %"):
        read_lab(write(tmp_path, text.replace("Weg", "Weg [m]")), 200.0)
    read_lab(write(tmp_path, text.replace("Weg", "Dehnung [%]")))  # a strain needs no gauge length


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Weg;Kraft\n0;0\n1.234;5\n2.345;6\n", "--decimal"),
        ("Weg;Kraft\n0;0\n1;abc\n", ":3: 'abc'"),
        ("Weg;Kraft\n0;0\n2;5\n1;6\n", ":4: "),
        ("Weg;Kraft\n0;0\n1;nan\n", ":3: 'nan'"),
        ("Weg;Kraft\n0;0\n", "at least two"),
        ("a;b\n0;0\n1;1\n", "no header row names"),
        ("Weg;Kraft\n0;0\n1;2\n;\n3\n", ""),
        ("", "no header row names"),
    ],
)
def test_refused_with_the_row(tmp_path, text, words):
    with pytest.raises(InputError, match=r"export\.csv") as caught:
        read_lab(write(tmp_path, text), 200.0)
    assert words in str(caught.value)


def test_binary_and_missing_files(tmp_path):
    path = tmp_path / "x.csv"
    path.write_bytes(b"\x00\x01\x02Weg;Kraft")
    for bad in (path, tmp_path / "missing.csv"):
        with pytest.raises(InputError, match=bad.name):
            read_lab(bad, 200.0)


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
