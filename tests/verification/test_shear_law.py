"""Shear with friction: envelope, loops and booked losses in closed form; definitions of force converted on input."""

from itertools import pairwise

import numpy as np
import pytest
from shell_cases import Solid, X, fabric, grid, linear_laminate
from test_shell_shear import SIDE, TABULATED, table, trellis

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.experiment.curves import ReferenceCurve
from knittest.kernels.shell_state import build_shells
from knittest.materials.shear import shear_table
from knittest.materials.trellis import crosshead_force, normalised_force, to_conjugate
from knittest.runs.specimen import prepare, run_specimen

C, SHARE, STICK = 0.5, 0.4, 1.6  # S = C gamma [N/mm], share of friction, sticking stiffness [N/mm]


def sheet(**law) -> Solid:
    position, conn = grid(2, 2, SIDE, SIDE)
    return Solid(position, build_shells(position, conn, X), linear_laminate(**law))


def drive(solid: Solid, path: np.ndarray) -> np.ndarray:
    """Shear force S [N/mm] along ``path`` [rad] from the nodal forces, by virtual work per reference area."""
    found = []
    for gamma in path:
        h = 1e-6
        solid.place(trellis(solid.start, gamma) - solid.start)
        force, _ = solid.forces()
        rate = (trellis(solid.start, gamma + h) - trellis(solid.start, gamma - h)) / (2.0 * h)
        found.append(-float((force * rate).sum()) / SIDE**2)
    return np.array(found)


def ways(*stops: float, steps: int = 400) -> np.ndarray:
    return np.concatenate([np.linspace(a, b, steps + 1)[1:] for a, b in pairwise(stops)])


def test_growing_shear_follows_the_envelope():
    """Friction is a share of the table, not an addition to it."""
    solid = sheet(shear_friction=0.7, shear_stick=2.0, **TABULATED)
    path = ways(0.0, 1.0)
    assert drive(solid, path) == pytest.approx([table(g) for g in path], rel=1e-6, abs=1e-9)


def test_turning_back_sticks_and_then_slides_the_other_way():
    """S falls by (1 - phi) c + k; from A (k - phi c) / (k + phi c) on it is (1 - 2 phi) c gamma."""
    solid = sheet(shear_friction=SHARE, shear_stick=STICK)
    top = 0.8
    drive(solid, ways(0.0, top))
    back = ways(top, 0.0)
    found = drive(solid, back)
    turned = top * (STICK - SHARE * C) / (STICK + SHARE * C)
    sticking = C * top - ((1.0 - SHARE) * C + STICK) * (top - back)
    expected = np.where(back > turned, sticking, (1.0 - 2.0 * SHARE) * C * back)
    assert found == pytest.approx(expected, abs=1e-6)


def test_a_small_turn_costs_nothing():
    """Back and forth within the sticking range: no loss, and the envelope goes on."""
    solid = sheet(shear_friction=SHARE, shear_stick=STICK)
    drive(solid, ways(0.0, 0.5))
    lost = solid.friction_losses
    drive(solid, ways(0.5, 0.45, 0.5))
    assert solid.friction_losses == pytest.approx(lost, rel=1e-9)
    assert drive(solid, np.array([0.6])) == pytest.approx(C * 0.6, rel=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_loop_is_the_energy_that_friction_takes(sign):
    """Loading and unloading: phi c A^2 (1 - r) / (1 + r) per area with r = phi c / k, again in every cycle; the same
    energy is booked as lost, and what is stored returns to 0. Rectangles over 4000 steps: order 1 / 4000.
    """
    solid = sheet(shear_friction=SHARE, shear_stick=STICK)
    top = 0.8 * sign
    path = ways(0.0, top, 0.0, top, 0.0, steps=4000)
    force = drive(solid, path)
    r = SHARE * C / STICK
    expected = SIDE**2 * SHARE * C * top**2 * (1.0 - r) / (1.0 + r)
    loop = SIDE**2 * np.trapezoid(np.append(0.0, force), np.append(0.0, path))
    assert loop == pytest.approx(2.0 * expected, rel=1e-4)
    assert solid.friction_losses == pytest.approx(2.0 * expected, rel=1e-3)
    assert solid.energy() == pytest.approx(0.0, abs=1e-9 * expected)


def test_a_table_loses_its_share_and_keeps_the_rest():
    """All friction: what loading stores is the spring's T^2 / 2 k alone, the rest of the area under S is lost."""
    solid = sheet(shear_friction=1.0, shear_stick=3.0, **TABULATED)
    path = ways(0.0, 0.9, steps=4000)
    drive(solid, path)
    area = SIDE**2 * np.trapezoid([table(g) for g in path], path)
    stored = SIDE**2 * table(0.9) ** 2 / (2.0 * 3.0)
    assert solid.energy() == pytest.approx(stored, rel=1e-6)
    assert solid.friction_losses == pytest.approx(area - stored, rel=2e-3)


POINTS = "[[0, 0], [10, 0.02], [30, 0.05], [46, 0.2]]"
TABLE = f"fabric.macro.shear={{kind: table, curve: null, source: assumed, points: {POINTS}}}"


def frame(*sets: str):
    settings = ("rig.side=50", "rig.mounting_slack=0", "rig.imperfection=0", TABLE, *sets)
    return resolve(variant="1", scale="macro", preset="quick", test="picture-frame", sets=list(settings))


def test_the_frame_force_of_a_table_is_the_closed_form():
    """F = S L_fabric^2 / (L_frame sin(pi/4 - gamma/2)) within 1 %, in a frame longer than the fabric as well; so is the
    normalised force S / cos gamma.
    """
    found = run_specimen(frame("rig.frame_side=80"))
    curve = found.history.curve
    degrees = curve["frame_shear_angle_deg"]
    judged = (degrees > 9.0) & (degrees < 44.5)
    angle = np.deg2rad(degrees[judged])
    shear = np.interp(degrees[judged], [0, 10, 30, 46], [0, 0.02, 0.05, 0.2])
    expected = shear * 50.0**2 / (80.0 * np.sin(np.pi / 4.0 - 0.5 * angle))
    assert curve["shear_force_n"][judged] == pytest.approx(expected, rel=0.01)
    assert curve["normalised_shear_force_n_per_mm"][judged] == pytest.approx(shear / np.cos(angle), rel=0.01)
    assert found.results["material_shear_angle_deg_at_40deg"] == pytest.approx(40.0, abs=0.2)
    assert found.results["material_shear_angle_sd_deg_at_40deg"] < 0.1


def test_a_cycle_in_the_frame_is_a_loop_and_the_energies_balance():
    """0 - 30 - 0 - 40 deg in the frame: the loop of the crosshead force is what the run books as friction, up to its
    last loading, and energy error and kinetic energy stay below their limits.
    """
    found = run_specimen(
        frame("rig.reversal_angles=[30, 0]", "rig.max_angle=40", "fabric.macro.shear.friction_share=0.5")
    )
    curve, energies = found.history.curve, found.history.energies
    degrees = curve["frame_shear_angle_deg"]
    turned = int(np.argmax(degrees))
    back = np.argmax(degrees > 29.9) + int(np.argmin(degrees[np.argmax(degrees > 29.9) : turned]))
    loop = np.trapezoid(curve["shear_force_n"][:back], curve["displacement_mm"][:back])
    booked = np.interp(curve["time_ms"][back], energies["time_ms"], energies["friction_mj"])
    damped = np.interp(curve["time_ms"][back], energies["time_ms"], energies["damping_mj"])
    assert loop == pytest.approx(booked + damped, rel=0.01)
    assert booked > 0.2 * 50.0**2 * np.trapezoid([0.0, 0.02, 0.05], np.deg2rad([0.0, 10.0, 30.0]))
    assert found.quality.energy_error_max < 0.005
    assert found.quality.failures == ()


def test_definitions_are_converted_on_input():
    """A frame's normalised force and Cauchy stress times thickness, both S / cos gamma, give the same law as S."""
    degrees = np.array([0.0, 10.0, 25.0, 46.0])
    shear, angle = np.array([0.0, 0.02, 0.05, 0.2]), np.deg2rad(degrees)
    normalised = normalised_force(crosshead_force(shear, angle, 140.0, 216.0), angle, 140.0, 216.0)
    assert to_conjugate(normalised, angle, "normalised") == pytest.approx(shear)
    own = shear_table(fabric(shear={"kind": "table", "source": "assumed", "points": pairs(degrees, shear)}))
    for definition in ("normalised", "cauchy"):
        law = {"kind": "table", "source": "assumed", "definition": definition, "points": pairs(degrees, normalised)}
        for one, other in zip(shear_table(fabric(shear=law)), own, strict=True):
            assert one == pytest.approx(other)
    columns = {"normalised_shear_force_n_per_mm": normalised, "shear_force_n_per_mm": shear}
    for column, force in columns.items():
        table = shear_table(*by_curve(degrees, force, column))
        assert table.slope == pytest.approx(own.slope)


def pairs(degrees, force) -> list:
    return [list(pair) for pair in zip(degrees.tolist(), force.tolist(), strict=True)]


def by_curve(degrees, force, column: str, **law):
    shear = {"kind": "table", "source": "assumed", "curve": "shear.csv", **law}
    curve = ReferenceCurve(
        "input", np.array(degrees, float), np.array(force, float), None, "shear_angle_deg", column, ""
    )
    return fabric(shear=shear), curve


CONJUGATE = "shear_force_n_per_mm"


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (by_curve([0, 10, 20], [0, 1, 2], "force_n"), "expected shear_angle_deg and one of"),
        (by_curve([0, 10, 20], [0, 1, 2], CONJUGATE, definition="cauchy"), "column is conjugate"),
        (by_curve([0, 10, 20], [0, 1, 0.9], CONJUGATE), "falls at 20 deg"),
        (by_curve([0, 10, 20], [0.5, 1, 2], CONJUGATE), "starts at 0 deg, 0.5 N/mm"),
        (by_curve([0, 10, 95], [0, 1, 2], CONJUGATE), "below 90 deg"),
        (by_curve([0, 10, 20], [0, 0, 2], CONJUGATE), "rises from 0"),
        (by_curve([0, 10, 20], [0, 0, 0], CONJUGATE), "no force above 0"),
        (
            by_curve([0, 10, 20], [0, 1, 2], CONJUGATE, friction_share={"value": 1.0, "source": "assumed"},
                     unloading_stiffness={"value": 1.0, "source": "assumed"}),
            "would lag behind",
        ),
    ],
)  # fmt: skip
def test_bad_shear_curves_are_refused(given, says):
    with pytest.raises(InputError, match=says):
        shear_table(*given)


@pytest.mark.parametrize(
    ("setting", "says"),
    [
        ("rig.max_angle=50", "shear law .macro.shear. ends at 46 deg"),
        ("rig.frame_side=40", "at least the side of the square"),
        ("rig.reversal_angles=[5, 30]", "alternate between loading and unloading"),
        ("rig.reversal_angles=[60, 30]", "between 0 and max_angle"),
        ("fabric.macro.shear.points=[[0, 0], [20, 1], [10, 2]]", "must rise strictly"),
        ("fabric.macro.shear.points=[[5, 0], [20, 1]]", "the first .0, 0"),
        ("fabric.macro.shear.source=null", "origin of the table"),
        ("fabric.macro.shear.friction_share=1.5", "must be at most 1"),
        ("fabric.macro.shear.curve=nowhere.csv", "either curve .a CSV. or points"),
        ("fabric.macro.shear.kind=linear", "stiffness: missing"),
    ],
)
def test_bad_frames_are_refused(setting, says):
    with pytest.raises(InputError, match=says):
        prepare(frame(setting))


def test_a_frame_that_stops_before_40_deg_says_nothing_of_40_deg():
    """Its last state is no state at 40 deg, under whose name it stood."""
    found = run_specimen(frame("rig.max_angle=12")).results
    assert "shear_force_n_at_deg.10" in found and "wrinkle_onset_deg" in found
    assert not [name for name in found if name.endswith("_at_40deg")]
