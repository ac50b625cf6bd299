"""Any table of a frame, a cantilever or a friction test is read into finite numbers or refused, at once."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_fuzz import VALUES, judged, mutated, read_or_refused

from knittest.experiment.lab_table import ReadOptions
from knittest.experiment.lab_tests import LAB_TESTS, conditions

FRAME = (
    "Rahmenlänge;200,0;mm\nGewebeseite: 18 cm\nWeg;Kraft\nmm;N\n"
    "0,0;0,0\n10,5;1,25\n20,5;3,5\n30,75;1.250,5\n31;2\n29;1\n"
)
TABLES = {
    "picture-frame": (FRAME, "shear angle [rad],force [cN]\n0,0\n0.1,100\n0.3,3e2\n0.7,1000.25\n"),
    "cantilever": (
        "Flächengewicht;0,8242;kg/m²\nProbenbreite;5;cm\nProbe;Überhang\n;cm\n1;17,0\n1;17,2\n2;16,0\n",
        "plane angle;45;deg\noverhang [mm]\n171\n165\n",
    ),
    "friction": (
        "Normalkraft;2,0;kN\nPlattenlänge;150;mm\nWeg;Kraft\nmm;N\n0,0;0,0\n1,0;330,25\n10,5;300\n20;299,5\n",
        "travel [mm],force [kN]\n0,0\n0.5,0.3\n10,.29\n20,3e-1\n",
    ),
    "compaction": (
        "Platten;50;mm\nDicke;Druck\nmm;MPa\n3,0;0,0001\n2,8;0,001\n2,5;0,01\n2,1;0,5\n2,4;0,1\n",
        "thickness [cm],pressure [kPa]\n0.3,0.1\n0.28,1e0\n0.25,10.5\n0.2,.1e4\n",
    ),
}
SIZES = {
    "frame_side_mm": 200.0, "fabric_side_mm": 180.0, "area_mass_g_m2": 824.2,
    "normal_force_n": 2000.0, "plate_length_mm": 150.0, "plate_width_mm": 50.0,
}  # fmt: skip


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return tmp_path_factory.mktemp("fuzz")


def read_and_show(name, path, sizes):
    """Lines with the results of the specimens."""
    kind = LAB_TESTS[name]
    return kind.lines(kind.read(path, ReadOptions(sizes=sizes)))


@pytest.mark.parametrize("name", TABLES)
@judged(150)
@given(st.integers(0, 2**32), st.booleans(), st.booleans())
def test_mutated_exports(place, name, seed, first, told):
    raw = mutated(TABLES[name][not first], seed)
    known = {
        what.key: SIZES[what.key] for what in conditions() if what.key in SIZES and what in LAB_TESTS[name].conditions
    }
    lines = read_or_refused(place / "export.csv", raw, lambda path: read_and_show(name, path, known if told else {}))
    assert "nan" not in "\n".join(lines or []).replace("specimen", "").lower().split()


@pytest.mark.parametrize("name", TABLES)
@judged(60)
@given(st.lists(st.lists(st.sampled_from([*VALUES, "0", "1", "20", "2,5"]), max_size=4), max_size=8))
def test_random_tables(place, name, rows):
    head = TABLES[name][1].splitlines()[-3 if name == "cantilever" else 0].replace(",", ";")
    text = "\n".join([head, *(";".join(cells) for cells in rows)])
    read_or_refused(place / "export.csv", text.encode(), lambda path: read_and_show(name, path, SIZES))


def test_unharmed_tables_are_read(place):
    for name, texts in TABLES.items():
        for text in texts:
            assert read_or_refused(place / "a.csv", text.encode(), lambda path, n=name: read_and_show(n, path, SIZES))
