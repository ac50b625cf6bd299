"""Yarns that bend in the plane, in bodies: energies, breaking, threads, state, and what is refused."""

import re

import numpy as np
import pytest
from shell_cases import fabric, grid, per_width, toe_curve

from knittest.base.errors import InputError
from knittest.materials.laminate import laminate, limit_membrane
from knittest.models.fabric_model import FabricModel
from knittest.models.macro import build_sheet
from knittest.pose import ALL, Body, linear_laminate, ramp

POINTS, CELLS = grid(12, 4, 24.0, 8.0)
LEFT, RIGHT = np.flatnonzero(POINTS[:, 0] < 3.0), np.flatnonzero(POINTS[:, 0] == 24.0)


def card(stiffness=(40.0, 40.0), **changes):
    """Soft in shear: what bends in the plane is the yarns."""
    return linear_laminate((900.0, 900.0), (1.0, 1.0), 0.01, 1.0, in_plane=stiffness, **changes)


def strip(threads: int = 1, **changes) -> Body:
    """A strip along the warp, clamped in two columns of nodes, flat, its right edge pushed along y within 1 ms."""
    body = Body.of_shells(POINTS, CELLS, card(**changes), 1e-3, 1.0, (1.0, 0.0, 0.0), threads=threads)
    for dof in ALL:
        body.boundary.move(LEFT, dof)
    body.boundary.move(np.setdiff1d(np.arange(len(POINTS)), LEFT), "z")
    body.boundary.load(RIGHT, "y", 0.01, ramp(1.0, 1.0))
    return body


def built(stiffness=(40.0, 40.0)) -> FabricModel:
    return build_sheet(POINTS, CELLS, card(stiffness), 1e-3, 1.0, (1.0, 0.0, 0.0))


def test_the_yarns_hold_a_strip_and_their_energy_is_in_the_balance():
    """Bending stores some of the work, none of it unbooked; without it the same strip goes far further."""
    body, free = strip(), strip(stiffness=(0.0, 0.0))
    for each in (body, free):
        each.advance(8.0)
        energies = each.energies()
        assert abs(energies["balance"]) < 5e-3 * energies["external"] > 0.0
    sag = [float(each.position[RIGHT, 1].mean() - 4.0) for each in (body, free)]
    assert sag[1] > 3.0 * sag[0] > 0.0


def test_the_bits_do_not_depend_on_the_threads():
    """Nor does what breaks, or the energy of the yarns that are cut with it."""
    found = []
    for threads in (1, 2):
        body = strip(threads, fail_strain=(2e-4, np.inf))
        body.boundary.load(RIGHT, "x", 0.5, ramp(1.0, 1.0))
        body.advance(6.0)
        found.append((body.position.tobytes(), body.energies()["eroded"], body.model.count_failed()[0]))
    assert found[0] == found[1]
    assert found[0][2] > 0 and found[0][1] > 0.0
    assert (body.model.bends.alive == 0.0).sum() > (built().bends.alive == 0.0).sum()


def test_cut_yarns_come_back_with_the_state():
    model, fresh = built(), built()
    model.bends.alive[4], model.bends.broken[2] = 0.0, 0.5
    fresh.restore(model.state())
    assert fresh.bends.alive.tolist() == model.bends.alive.tolist() and fresh.bends.broken[2] == 0.5
    with pytest.raises(InputError):
        built((0.0, 0.0)).restore({k: v for k, v in model.state().items() if "shells" not in k})


def test_the_step_is_shorter_by_their_stiffness_and_only_then():
    """2 / dt^2 grows by 16 B / h^2 of each family over the mass of a node, at most."""
    plain, stiff = ((2.0 / built(b).critical_step) ** 2 for b in ((0.0, 0.0), (40.0, 20.0)))
    without = build_sheet(POINTS, CELLS, card()._replace(in_plane=np.zeros(2)), 1e-3, 1.0, (1.0, 0, 0))
    assert plain == (2.0 / without.critical_step) ** 2
    assert stiff - plain == pytest.approx(16.0 * 60.0 / 4.0 / (1e-3 * 4.0))


def test_yarns_that_shear_made_too_stiff_for_the_step_are_named():
    """Crumpled, and sheared until warp and weft nearly lie in one line; of yarns at rest or cut nothing is said."""
    model = built((4000.0, 4000.0))
    assert model.stable_step()[0] == pytest.approx(model.critical_step)
    crumpled = POINTS + np.random.default_rng(2).normal(0.0, 0.3, POINTS.shape)
    sheared = crumpled @ np.array([[1.0, 0.0, 0.0], [np.sin(1.3), np.cos(1.3), 0.0], [0.0, 0.0, 1.0]])
    model.nodes.position[:, : model.n_nodes] = sheared.T
    step, where = model.stable_step()
    assert step < 0.9 * model.critical_step
    assert re.match(r"in-plane bending of sheared yarns at node \d+ of shell \d+", where)
    model.bends.alive[:] = 0.0
    assert model.stable_step()[0] > model.critical_step


def test_the_fabric_says_how_stiff_its_yarns_are():
    """Per width; kept where the membrane is softened; none by default."""
    curves = per_width({d: toe_curve(5000.0, 1.6) for d in ("warp", "weft")})
    assert laminate(fabric(), curves).in_plane.tolist() == [0.0, 0.0]
    q = {d: {"value": v, "source": "assumed"} for d, v in (("warp", 4.2), ("weft", 3.47))}
    found = laminate(fabric(in_plane_bending=q), curves)
    assert found.in_plane.tolist() == [4.2, 3.47] == limit_membrane(found, 0.05).in_plane.tolist()
    with pytest.raises(ValueError, match="weft"):
        fabric(in_plane_bending={"warp": q["warp"]})


@pytest.mark.parametrize("wrong", [(-1.0, 1.0), (np.nan, 1.0), (1.0,)])
def test_a_stiffness_that_cannot_be_is_refused(wrong):
    with pytest.raises(InputError, match="in_plane"):
        card(wrong)
