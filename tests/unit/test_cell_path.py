"""Paths of a cell: lattices on the way, forces conjugate to it, files of steps, and paths that tear."""

from types import SimpleNamespace

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.fabric.relaxation import relaxed_cell
from knittest.laboratory.cell import test
from knittest.laboratory.cell.config import read_steps
from knittest.laboratory.cell.path import KNOTS, path_of, time_path
from knittest.laboratory.cell.test import Cell, curl, secant
from knittest.laboratory.cell.test import torn_message as said_of_torn
from knittest.models.crossings import parts_of_nodes
from knittest.models.meso import build_meso_cell
from knittest.solve.state import SILENT

REFERENCE = np.array([[4.0, 0.0, 0.0], [0.0, 3.0, 0.0]])
GOOD = "fraction,f_xx,f_xy,f_yx,f_yy\n0,1,0,0,1\n0.5,1,0.2,0.1,1\n1,1.1,0,0,1\n"


def run_of(*sets: str):
    return resolve(variant="1", test="cell", preset="quick", sets=list(sets))


def test_a_trellis_keeps_the_lengths_of_both_vectors_and_reaches_its_angle():
    path = path_of(run_of("rig.max_angle=30"), REFERENCE)
    a, b = path.at[:, :2], path.at[:, 3:5]
    assert np.hypot(*a.T) == pytest.approx(4.0) and np.hypot(*b.T) == pytest.approx(3.0)
    angle = 90.0 - np.rad2deg(np.arccos(np.sum(a * b, axis=1) / 12.0))
    assert angle == pytest.approx(np.linspace(0.0, 30.0, KNOTS + 1))


def test_an_end_on_the_way_moves_no_cell_otherwise_and_goes_with_shear_alone():
    run, sooner = run_of("rig.max_angle=30"), run_of("rig.max_angle=30", "rig.end_angle=11")
    assert np.array_equal(path_of(run, REFERENCE).at, path_of(sooner, REFERENCE).at)
    assert (run.rig.last_angle, sooner.rig.last_angle) == (30.0, 11.0)
    with pytest.raises(InputError, match=r"end_angle.*must be at most max_angle, 30 deg"):
        run_of("rig.max_angle=30", "rig.end_angle=31")
    with pytest.raises(InputError, match=r"end_angle.*only .*rig.path=shear"):
        run_of("rig.path=warp", "rig.end_angle=11")


def test_a_cell_that_ends_sooner_gives_the_places_that_it_came_to():
    angle, ones = np.linspace(0.0, 21.0, 421), np.ones(421)
    history = SimpleNamespace(
        curve={"shear_angle_deg": angle, "conjugate_force": 0.1 * angle}, contacts={"thickness_mm": ones},
        energies={"friction_mj": ones, "external_mj": ones},
    )  # fmt: skip
    for judged, places in ((2.5, [1, 10, 20]), (25.0, [10, 20])):  # of the whole path: from 1.0 and from 10.0 deg on
        run = run_of("rig.max_angle=40", "rig.end_angle=21", f"rig.evaluated_from={judged}")
        found = Cell().results(run, SimpleNamespace(mount=None), history)
        forces = {name: value for name, value in found.items() if "shear" in name}
        assert forces == pytest.approx({f"cell_shear_n_per_mm_at_deg.{a}": 0.1 * a for a in places})


def test_the_conjugate_force_is_the_work_a_coordinate():
    """A tension T of both vectors along themselves does none; on turning them they give a (t_a x a) / 2 each."""
    path = path_of(run_of("rig.max_angle=30"), REFERENCE)
    along = np.append(path.at[200, :6], 0.0)
    assert path.conjugate(along, 0.5) == pytest.approx(0.0, abs=1e-4)
    across = np.array([-along[1], along[0], 0.0, 0.0, 0.0, 0.0, 0.0])
    assert path.conjugate(across, 0.5) == pytest.approx(0.5 * 4.0 * 4.0, rel=1e-4)


@pytest.mark.parametrize(
    ("kind", "expected"), [("warp", (4.0, 3.03)), ("weft", (4.04, 3.0)), ("biaxial", (4.02, 3.03))]
)
def test_stretches_go_along_their_yarns(kind, expected):
    path = path_of(run_of(f"rig.path={kind}", "rig.ratio=0.5"), REFERENCE)
    assert path.at[-1, [0, 4]] == pytest.approx(expected)
    assert path.free == {"warp": ("ax",), "weft": ("by",), "biaxial": ()}[kind]
    assert path_of(run_of(f"rig.path={kind}", "rig.transverse=held"), REFERENCE).free == ()


def test_rates_bring_the_lattice_to_the_end_of_its_path():
    run = run_of("rig.max_angle=40")
    path, progress = time_path(run, path_of(run, REFERENCE))
    for name, table in path.rates(progress).items():
        q = ("ax", "ay", "az", "bx", "by").index(name)
        assert table.integral(path.duration) == pytest.approx(path.at[-1, q] - path.at[0, q], rel=1e-4)
        assert table.value[0] == 0.0
    # 100 mm of fabric at the speed of the run
    assert progress.value[-1] * path.end == pytest.approx(run.solver.speed / 100.0)


def test_lines_of_a_trellis_come_to_the_shorter_diagonal():
    """A square sheared by an angle g has diagonals of sqrt(1 +- sin g); what only grows keeps all images near."""
    assert path_of(run_of("rig.max_angle=30"), np.diag([4.0, 4.0, 0.0])[:2]).shrink == pytest.approx(np.sqrt(0.5))
    assert path_of(run_of("rig.path=biaxial"), REFERENCE).shrink == 1.0


def test_a_cell_keeps_images_as_far_as_its_yarns_are_said_to_slide():
    """Loops of 0.12 N mm2, sheared to 40 deg, came where images by the default way, two radii, ended."""
    near, far = (Cell().prepare(run_of(f"rig.max_slip={slide}")).model for slide in (2, 4))
    assert far.images.ghost.size > near.images.ghost.size and far.owned.sum() == near.owned.sum()


def test_yarns_are_bent_about_their_own_middle():
    """Off the surface that keeps its length they would be stretched by curvature times height, and swing to it."""
    run = run_of("rig.path=bending")
    for about in ("warp", "weft"):
        model = build_meso_cell(run, relaxed_cell(run.fabric), 1, 1, 0.05, 1.0, about)
        of = (parts_of_nodes(model) == model.mesh.part_names.index(about)) & (model.owned > 0.0)
        assert model.position()[of, 2].mean() == pytest.approx(0.0, abs=1e-12)


def test_the_bending_stiffness_is_the_secant_of_the_second_half():
    x = np.linspace(0.0, 2.0, 201)
    assert secant(x, np.where(x < 1.0, 9.0 * (x > 0.0), 3.0 * x)) == pytest.approx(3.0)


def test_free_fabric_curls_to_where_it_has_no_moment():
    """From a moment of -0.2 N at rest up by 4 N mm: none at 0.05/mm; what lies between does not matter."""
    x = np.linspace(0.0, 0.1, 11)
    assert curl(x, np.where(x < 0.1, -0.2, 0.2)) == pytest.approx(0.05)
    assert curl(x, 0.2 + 4.0 * x) == pytest.approx(-0.05)


@pytest.mark.parametrize(("torn", "strain"), [("ends", 0.9), ("ends", 1.1), ("refused", 1.1)])
def test_a_path_ends_where_a_yarn_comes_to_its_fracture_strain_if_it_may(torn, strain, monkeypatch):
    run = run_of("rig.path=warp", f"rig.at_fracture={torn}", "rig.max_strain=1.5")
    monkeypatch.setattr(test, "record_row", lambda model: {})
    fracture = run.fabric.reinforcing.fracture_strain_fraction
    mesh = SimpleNamespace(part_names=("warp", "weft", "knit"), part=np.array([0, 1, 2]))
    fields = {"axial_strain": np.array([strain * fracture, 0.0, 0.0])}
    model = SimpleNamespace(record=[], fields=lambda: fields, mesh=mesh)
    mount = SimpleNamespace(model=model, torn=False, share=lambda time: 0.5, ends_at=np.inf)
    watch = test.Recorder(run, mount, SILENT)
    if torn == "refused":
        # the first row: 0.9 of half the path's 1.5 %, over 1.1
        with pytest.raises(InputError, match=r"tears the warp yarns.* rig\.max_strain=0\.61"):
            watch.progress(0.5, 1.0, 1.0, 0.0)
    else:
        watch.progress(0.5, 1.0, 1.0, 0.0)
        assert mount.torn == (strain > 1.0)


def test_steps_of_a_file_are_kept_in_the_config(tmp_path):
    file = tmp_path / "steps.csv"
    file.write_text(GOOD)
    run = run_of(f"rig.path={file}")
    assert run.rig.path == "steps" and run.rig.steps[1] == (0.5, 1.0, 0.2, 0.1, 1.0)
    at = path_of(run, REFERENCE).at
    assert at[KNOTS // 2, :5] == pytest.approx([4.0, 0.4, 0.0, 0.6, 3.0]) and at[-1, 0] == pytest.approx(4.4)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("f_xx\n1\n", "line 1: expected the header fraction,f_xx"),
        (GOOD.replace("0,1,0,0,1", "0,1,0.1,0,1"), "line 2: the path begins with the undeformed fabric"),
        (GOOD.replace("0.5,", "0,"), "line 3: fraction = 0: expected more than 0"),
        (GOOD.replace("0.2,0.1", "2,2"), "line 3: the gradient has the determinant -3"),
        (GOOD.replace("1.1", "x"), "line 4: 1,x,0,0,1: expected 5 finite numbers"),
        (GOOD.replace("1.1", "nan"), "line 4: .* 5 finite numbers"),
        (GOOD.replace("1,1.1", "0.9,1.1"), "the last of fraction 1"),
    ],
)
def test_a_file_of_steps_is_refused_by_its_line(tmp_path, text, said):
    file = tmp_path / "steps.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=said):
        read_steps(str(file))
    with pytest.raises(InputError, match="cannot be read"):
        read_steps(str(tmp_path / "none.csv"))


def test_unknown_paths_steps_without_a_file_and_shells_are_refused():
    with pytest.raises(InputError, match=r"rig\.path.*shear"):
        run_of("rig.path=twist")
    with pytest.raises(InputError, match=r"rig\.path=FILE\.csv"):
        run_of("rig.path=steps")
    with pytest.raises(InputError, match="expected meso, the scale of test cell"):
        resolve(variant="1", test="cell", scale="macro")


def test_a_path_that_tears_the_cell_names_the_number_that_would_do():
    """Straight yarns break at (1 + crimp) (1 + fracture strain) - 1."""
    run = run_of("rig.path=warp", "rig.max_strain=2")
    yarn = run.fabric.reinforcing
    most = 100.0 * ((1.0 + yarn.crimp_fraction.warp) * (1.0 + yarn.fracture_strain_fraction) - 1.0)
    with pytest.raises(InputError, match=r"tears the warp yarns.*rig\.max_strain=([\d.]+)") as refused:
        Cell().check_run(run)
    given = float(str(refused.value).rpartition("rig.max_strain=")[2].split()[0])
    assert 0.9 * most < given <= most
    Cell().check_run(run_of("rig.path=warp", f"rig.max_strain={given}"))
    said = said_of_torn(run_of("rig.path=weft", "rig.max_strain=1"), "knit", 0.1, 0.5)
    assert "tears the knit yarns, whose fracture strain is 10.00 %; use --set rig.max_strain=0.5" in said


def test_loops_of_a_cell_are_drawn_in_as_the_fabric_says():
    """All loops of the cell and of its images: none is at an edge."""
    plain, drawn = (
        build_meso_cell(run, relaxed_cell(run.fabric), 1, 1)
        for run in (run_of(), run_of("fabric.knitting.loop_shortening=2"))
    )
    knit = parts_of_nodes(drawn) == drawn.mesh.part_names.index("knit")
    shorter = plain.beams.inv_length / drawn.beams.inv_length
    joined = drawn.beams.alive > 0.0
    assert shorter[knit & joined] == pytest.approx(0.98) and shorter[~knit & joined] == pytest.approx(1.0)
    assert drawn.pressed and drawn.prestressed


def test_a_cell_that_is_relaxed_on_its_way_stands_while_it_is():
    """The motion begins later than any time step, as a relaxation reads all motions at the start; a row is 0.4 %."""
    run = resolve(variant="jersey", test="cell", scale="meso", preset="quick", sets=["rig.path=weft"])
    model = Cell().prepare(run)
    rig = model.rig
    assert rig.progress.integral(100.0 * model.model.critical_step) == 0.0 < rig.progress.integral(1.0)
    assert rig.relaxed_rows == 100 and rig.rest_force > 0.0
    assert rig.progress.integral(rig.duration) == pytest.approx(1.0)
    assert Cell().prepare(run_of("rig.path=weft")).rig.relaxed_rows == 0
