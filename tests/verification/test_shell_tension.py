"""The strip reproduces its input curve: exactly when stretched evenly, and in an explicit run to failure."""

import numpy as np
import pytest
from shell_cases import CURVES, Solid, fabric, per_width

from knittest.kernels.shell_output import shell_fields
from knittest.materials.laminate import laminate
from knittest.models.fabric_model import FabricModel
from knittest.models.macro import STRENGTH_MARGIN, StripShape, build_strip
from knittest.pose import Body, ramp

FAIL = {"warp": 1.6, "weft": 1.5}


def strip(direction: str, **changes) -> tuple[FabricModel, Solid]:
    card = fabric()
    values = {"gauge_length": 200.0, "width": 50.0, "jaw_length": 10.0, "element_size": 5.0, **changes}
    model = build_strip(card, laminate(card, per_width(CURVES)), direction, StripShape(**values))
    return model, Solid(model.position(), model.shells, model.laminate)


def test_the_paper_preset_has_440_shells():
    """Table 4 of Pham et al. (2019): 440 shells; the mass is area times area mass."""
    model, _ = strip("warp")
    assert len(model.mesh.cells) == 440
    assert model.mass.sum() == pytest.approx(220.0 * 50.0 * 824.2e-6, rel=1e-12)
    lower, upper = (model.position()[jaw, 1] for jaw in jaws(model))
    assert np.ptp(upper) == pytest.approx(10.0)
    gauge = upper.min() - lower.max()
    assert gauge == pytest.approx(200.0, rel=1e-12)


@pytest.mark.parametrize("direction", ["warp", "weft"])
def test_even_stretch_gives_the_input_curve(direction):
    """N(e) = curve(e) / 50 mm within 0.1 % of the force at every strain from 5 % of the range on, both directions."""
    model, solid = strip(direction)
    strain, force = CURVES[direction]
    for e in np.linspace(0.05, 0.999, 40) * FAIL[direction]:
        solid.place(model.position() * [0.0, 0.01 * e, 0.0])
        found, _ = solid.forces()
        reaction = -found[model.position()[:, 1] > 105.0, 1].sum()  # the jaw's outer rows pull on the rest
        assert reaction == pytest.approx(np.interp(e, strain, force), rel=1e-3, abs=2e-4 * 5820.0)
    assert np.isinf(model.shells.fail_time[:440]).all()
    solid.place(model.position() * [0.0, 0.01001 * FAIL[direction], 0.0])
    solid.forces(time=3.0)
    assert np.count_nonzero(model.shells.fail_time[:440] == 3.0) == 1  # the weakest shell
    solid.place(model.position() * [0.0, 0.01001 * (1.0 + STRENGTH_MARGIN) * FAIL[direction], 0.0])
    solid.forces(time=4.0)
    assert np.count_nonzero(model.shells.fail_time[:440] == 4.0) == 439


def jaws(model: FabricModel, gauge: float = 200.0) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the fixed and the moving jaw."""
    y = model.position()[:, 1]
    return np.flatnonzero(y < -0.4999 * gauge), np.flatnonzero(y > 0.4999 * gauge)


def run(model: FabricModel, speed: float, start: float) -> dict[str, np.ndarray]:
    """Pull the jaw after a smooth start [ms] until elements fail."""
    body = Body(model, damping=0.5)
    fixed, moving = (
        body.boundary.grip(jaw, "y", t) for jaw, t in zip(jaws(model), (None, ramp(start, speed)), strict=True)
    )
    rows = []
    while np.isinf(model.shells.fail_time[:440]).all() and body.time < 10.0:
        body.advance(20 * body.dt)
        energy = body.energies()
        travel = ramp(start, speed).integral(body.time)
        rows.append([travel / 200.0, body.reaction(moving), -body.reaction(fixed), *energy.values()])
    names = ("strain", "moving", "fixed", *energy)
    return dict(zip(names, np.array(rows[:-1]).T, strict=True))  # up to the first failure


@pytest.mark.parametrize("direction", ["warp", "weft"])
def test_explicit_run_gives_the_input_curve(direction):
    """Pulled at 2 m/s the mean jaw force follows the input within 1 % of the peak up to failure; energies close."""
    model, _ = strip(direction)
    found = run(model, speed=2.0, start=1.0)
    strain, force = CURVES[direction]
    expected = np.interp(100.0 * found["strain"], strain, force)
    mean = 0.5 * (found["moving"] + found["fixed"])
    assert np.abs(mean - expected).max() < 0.01 * expected.max()
    assert 100.0 * found["strain"][-1] == pytest.approx(FAIL[direction], rel=0.02)
    assert found["hourglass"].max() < 1e-6 * found["internal"].max()
    assert abs(found["balance"][-1]) < 0.01 * found["external"][-1]
    assert found["internal"][-1] == pytest.approx(200.0 * 50.0 * integral(direction, found["strain"][-1]), rel=0.01)


def integral(direction: str, strain: float) -> float:
    """Area under the input curve up to ``strain`` [mJ/mm^2]."""
    e = np.linspace(0.0, 100.0 * strain, 4001)
    return float(np.trapezoid(np.interp(e, *CURVES[direction]) / 50.0, 0.01 * e))


def test_imperfection_is_seeded_and_free_of_stress():
    """Offsets stay within the amplitude, off the jaws, repeat with the seed, and cost no energy."""
    model, solid = strip("warp", imperfection=0.2, seed=7)
    again, _ = strip("warp", imperfection=0.2, seed=7)
    other, _ = strip("warp", imperfection=0.2, seed=8)
    z = model.position()[:, 2]
    assert np.array_equal(z, again.position()[:, 2])
    assert not np.array_equal(z, other.position()[:, 2])
    assert 0.1 < np.abs(z).max() <= 0.2
    assert not z[np.concatenate(jaws(model))].any()
    force, _ = solid.forces()
    assert np.abs(force).max() < 1e-10


@pytest.mark.parametrize("shear", [0.0, 0.9])
def test_critical_step_is_safe_and_not_wasteful(shear):
    """dt omega_max <= 2 for the assembled model in tension at rest and sheared by 0.9 rad; above 2 / sqrt(2.2)."""
    model, solid = strip("warp", gauge_length=20.0, width=20.0, jaw_length=5.0)
    start = model.position()
    stretched = start * [np.cos(0.5 * shear), np.cos(0.5 * shear), 1.0]
    stretched[:, :2] += np.sin(0.5 * shear) * start[:, 1::-1]
    stretched *= 1.0149
    m = np.repeat(np.c_[model.mass, model.inertia], 3, axis=1).ravel()
    stiffness = solid.tangent(stretched - start)
    scaled = 0.5 * (stiffness + stiffness.T) / np.sqrt(np.outer(m, m))
    omega = np.sqrt(np.linalg.eigvalsh(scaled)[-1])
    assert 2.0 / np.sqrt(2.2) < model.critical_step * omega <= 2.0


def test_fields_of_the_stretched_strip():
    """Strain and force per width of the pulled direction only; weft strips have their weft along y."""
    model, solid = strip("weft")
    solid.place(model.position() * [0.0, 0.01, 0.0])
    warp, weft, angle, force_warp, force_weft = shell_fields(440, solid.nodes, solid.shells, solid.laminate)
    assert weft == pytest.approx(0.01, rel=1e-9)
    assert np.abs(np.concatenate([warp, angle, force_warp])).max() < 1e-9
    assert 50.0 * force_weft == pytest.approx(np.interp(1.0, *CURVES["weft"]), rel=1e-3)
