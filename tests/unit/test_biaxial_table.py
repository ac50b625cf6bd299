"""CSV of forces over two strains, its field in a fabric file, and what the checks of a run say beyond it."""

import sys
from pathlib import Path

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.base.history import History
from knittest.config.loading import resolve
from knittest.experiment.biaxial_table import COLUMNS, read_biaxial
from knittest.laboratory.base import fabric_laminate, tension_curve
from knittest.laboratory.shear_law_end import find_law_excess

sys.path.append(str(Path(__file__).parents[1] / "verification"))
from test_biaxial_law import WARP, WEFT, knit, table_of

HEAD = ",".join(COLUMNS)
GRID = [(a, b) for a in (-10, 0, 10, 20) for b in (-20, -10, 0, 10)]
FABRIC = """name: jersey
warp_density: {value: 28, source: assumed}
weft_density: {value: 40, source: assumed}
area_mass: {value: 250, source: assumed}
thickness: {value: 1.2, source: assumed}
macro:
  biaxial: {curve: knit.csv, source: predicted, ref: formula}
  bending_stiffness: {warp: {value: 0.02, source: assumed}, weft: {value: 0.02, source: assumed}}
  shear: {kind: linear, stiffness: {value: 0.3, source: assumed}}
"""


def write(path: Path, rows) -> Path:
    path.write_text("\n".join(["# kind: predicted", HEAD, *(",".join(map(str, row)) for row in rows)]) + "\n")
    return path


def full(*, drop=()) -> list:
    return [(a, b, 0.1 * a + 0.05 * b, 0.1 * b + 0.05 * a) for a, b in GRID if (a, b) not in drop]


def test_a_table_is_read_in_any_order(tmp_path):
    table = read_biaxial(write(tmp_path / "t.csv", reversed(full(drop=[(20, 10)]))))
    assert table.warp == pytest.approx([-0.1, 0.0, 0.1, 0.2]) and table.weft == pytest.approx([-0.2, -0.1, 0.0, 0.1])
    assert table.force[2, 0] == pytest.approx([0.0, -1.5]) and np.isnan(table.force[3, 3]).all()
    assert len(table.samples[0]) == 15


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ([*full(), (30, 0, "x", 1)], r"t.csv:19: force_warp_n_per_mm = 'x'; expected a finite number"),
        ([*full(), (30, 0, 1, "nan")], r"t.csv:19: force_weft_n_per_mm = 'nan'; expected a finite number"),
        ([*full(), (30, 0, 1)], r"t.csv:19: 3 cells; expected 4"),
        ([*full(), (0, 0, 1, 1)], r"t.csv:19: a second row of strain_warp_pct = 0, strain_weft_pct = 0"),
        ([*full(), (600, 0, 1, 1)], r"t.csv:19: strain_warp_pct = 600 %; expected -95 to 500 %"),
        (full(drop=[(0, 0)]), r"no row of strain_warp_pct = 0, strain_weft_pct = 0; expected it"),
        (full(drop=[(10, 0)]), r"no row of strain_warp_pct = 10, strain_weft_pct = 0; .*pair"),
        ([row for row in full() if row[0] != 20], r"3 different strain_warp_pct; expected at least 4, 0 among them"),
        ([(a, b + 1, *f) for a, b, *f in full()], r"4 different strain_weft_pct; .* 0 among them"),
    ],
)  # fmt: skip
def test_bad_rows_are_named(tmp_path, rows, message):
    with pytest.raises(InputError, match=message):
        read_biaxial(write(tmp_path / "t.csv", rows))


def test_a_wrong_header_is_named(tmp_path):
    (tmp_path / "t.csv").write_text("# kind: measured\nstrain_pct,force_n\n0,0\n")
    with pytest.raises(InputError, match=rf"t.csv:2: strain_pct,force_n; expected the header {HEAD}"):
        read_biaxial(tmp_path / "t.csv")


@pytest.fixture
def jersey(tmp_path) -> Path:
    """Fabric file of a knit with its table."""
    strain, force = table_of(knit).samples
    write(tmp_path / "knit.csv", np.column_stack([100.0 * strain, force]).round(9).tolist())
    (tmp_path / "jersey.yaml").write_text(FABRIC)
    return tmp_path / "jersey.yaml"


def test_a_fabric_file_with_a_table(jersey):
    """Nothing is missing in its card, nothing fails, strips have the curve of free contraction."""
    run = resolve(fabric=jersey, scale="macro", test="tensile", direction="warp", sets=["rig.max_strain=40"])
    assert run.fabric.macro.missing_card_parts == () and set(run.fabric.macro.curve_files) == {"biaxial"}
    assert fabric_laminate(run).energy is not None
    curve = tension_curve(run.fabric, "warp")
    assert curve.x[-1] == pytest.approx(100.0 * WARP[-1])
    tangent = np.interp(1.0, curve.x, curve.mean)
    assert tangent == pytest.approx(0.01 * (1.5 - 0.8**2 / 1.4), rel=0.03)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("  biaxial:", "  poisson: {value: 0.3, source: assumed}\n  biaxial:", "poisson.*must be 0 with biaxial"),
        ("  biaxial:", "  tension: {warp: knit.csv, weft: knit.csv}\n  biaxial:", "biaxial takes the place of tension"),
        ("source: predicted,", "", "source"),
        ("knit.csv", "none.csv", "no such file"),
    ],
)
def test_contradictions_are_named(jersey, old, new, message):
    jersey.write_text(jersey.read_text().replace(old, new, 1))
    with pytest.raises(InputError, match=message):
        resolve(fabric=jersey, scale="macro", test="tensile", direction="warp", sets=["rig.max_strain=40"])


def test_shells_beyond_the_table_count(jersey):
    """A quarter of the area beyond it, in a frame of four shells."""
    from knittest.base.history import Frame, Mesh

    run = resolve(fabric=jersey, scale="macro", test="tensile", direction="warp", sets=["rig.max_strain=40"])
    x, y = np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0, 2.0])
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(9)])
    cells = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
    zero = np.zeros(4, np.int64)
    mesh = Mesh("shells", cells, zero, ("fabric",), zero, np.ones(4))
    end = 1.05 * np.array([WARP[-1], WEFT[-1]])
    fields = {
        "strain_warp": np.array([0.1, end[0], 0.2, -0.3]), "strain_weft": np.array([0.0, -0.2, 0.3, 0.4]),
        "shear_angle": np.zeros(4), "alive": np.ones(4),
    }  # fmt: skip
    frame = Frame.__new__(Frame)
    for name, value in {"time": 1.0, "position": points, "fields": fields}.items():
        object.__setattr__(frame, name, value)
    history = History.__new__(History)
    for name, value in {"mesh": mesh, "frames": [frame], "curve": {}}.items():
        object.__setattr__(history, name, value)
    found = find_law_excess(run, history, to_failure=False)
    assert found.share == pytest.approx(0.25)
    assert "25.0 % of the fabric is strained beyond the table of macro.biaxial, up to 63 % (warp)" in found.stated
    assert "extend fabric.macro.biaxial to 63 % (warp)" in found.advice(run)
