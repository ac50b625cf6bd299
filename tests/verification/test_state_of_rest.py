"""Yarns that start under tension and press each other where they overlap: closed forms, and fabric at rest."""

import numpy as np
import pytest
from yarn_cases import card

from knittest.config.loading import resolve
from knittest.fabric.relaxation import relaxed_cell
from knittest.fabric.strip import strip
from knittest.fabric.topology import YarnDraws
from knittest.kernels.monitor import axial_state
from knittest.models.meso import build_meso
from knittest.models.yarn_model import YarnModel
from knittest.pose import ALL, Body, Chain, YarnContact, section
from knittest.runs.specimen import run_specimen

CARD = section(axial=2000.0, bending=0.5, radius=0.25, linear_density=2e-4)
LINE = np.arange(-3.0, 3.01, 0.4)
STIFFNESS, OVERLAP = 500.0, 0.02


def crossed(pressed: bool) -> Body:
    """Two held yarns whose axes cross nearer than their radii by :data:`OVERLAP`."""
    zero = np.zeros_like(LINE)
    upper = np.column_stack([LINE, zero, zero + 0.5 - OVERLAP])
    chains = [Chain(upper, CARD), Chain(np.column_stack([zero, LINE, zero]), CARD)]
    body = Body.of_chains(chains, YarnContact(STIFFNESS, 50.0, 0.3, pressed=pressed))
    body.boundary.move(np.arange(2 * len(LINE)), ALL)
    return body


@pytest.mark.parametrize(("pressed", "force"), [(True, STIFFNESS * OVERLAP), (False, 0.0)])
def test_overlapping_yarns_press_by_all_of_it_or_not_at_all(pressed, force):
    """k d between held yarns once they have come to bear; overlap free of force is what does not press."""
    body = crossed(pressed)
    body.relax()
    model = body.model
    assert isinstance(model, YarnModel) and model.prestressed == pressed
    assert model.contact_force_sum() == pytest.approx(force, rel=1e-6, abs=1e-12)
    hidden = 0.0 if pressed else OVERLAP / 0.25
    assert model.stored_energies().force_free[0] == pytest.approx(hidden, abs=1e-9)
    assert model.prepare().largest == pytest.approx(hidden, abs=1e-9)


def test_a_yarn_drawn_in_between_fixed_ends_pulls_by_its_law():
    """N = EA p / (1 - p) at a rest length shorter by p, and no more than its strain in the energy."""
    share = 0.03
    body = Body.of_chains([Chain(np.column_stack([LINE, 0.0 * LINE, 0.0 * LINE]), CARD, loop_shortening=share)])
    model = body.model
    assert isinstance(model, YarnModel) and model.prestressed
    force = axial_state(model.nodes, model.parts, model.beams)[1][: len(LINE) - 1]
    assert force == pytest.approx(2000.0 * share / (1.0 - share), rel=1e-12)
    stored = 0.5 * 2000.0 * (share / (1.0 - share)) ** 2 * (1.0 - share) * np.ptp(LINE)
    assert model.stored_energies().internal.sum() == pytest.approx(stored, rel=1e-9)


def square(*sets: str) -> YarnModel:
    """4 x 4 cells of variant 1."""
    run = card(*sets)
    ones = YarnDraws(np.full(4, 10.0), np.zeros(4), np.ones(4), np.full(4, 0.5))
    mesh = run.model.meso
    paths = strip(relaxed_cell(run.fabric), 4, 4, mesh.elements_per_loop, mesh.elements_per_wave)
    return build_meso(run, paths, dict.fromkeys(("warp", "weft", "knit"), ones))


def test_only_loops_that_others_hold_are_drawn_in():
    """Not in courses at the cut edges, nor the first and last loop of a course; inlays never."""
    model, share = square("fabric.knitting.loop_shortening=2"), 0.02
    strain = axial_state(model.nodes, model.parts, model.beams)[0][model.element_node]
    drawn = strain > 1e-9
    assert strain[drawn] == pytest.approx(share / (1.0 - share), rel=1e-9)
    yarns = model.mesh.yarn[drawn]
    knit = np.unique(model.mesh.yarn[model.mesh.part == 2])
    assert np.unique(yarns).tolist() == knit[1:-1].tolist()
    assert drawn.sum() == 2 * 2 * card().model.meso.elements_per_loop  # 2 courses of 2 loops


def test_without_a_draw_in_nothing_is_drawn_in_or_pressed():
    model = square()
    lengths = np.linalg.norm(np.diff(model.position()[model.mesh.cells], axis=1)[:, 0], axis=1)
    assert (model.beams.inv_length[model.element_node] == 1.0 / lengths).all()
    assert not model.pressed


def test_a_settled_frame_presses_from_the_start_and_its_settling_is_no_work():
    """Loops are under tension and no overlap is free of force; energies count from the rest, and balance."""
    sets = ["rig.side=22", "rig.max_angle=4", "fabric.knitting.loop_shortening=1", "output.samples=60"]
    found = run_specimen(resolve(variant="1", scale="meso", preset="quick", test="picture-frame", sets=sets)).history
    knit = found.mesh.part == 2
    assert 0.05 < found.frames[0].fields["axial_force"][knit].mean() < 0.5
    assert found.contacts["force_free_overlap_max_pct"][0] < 0.1
    energies = found.energies
    elastic = sum(v for k, v in energies.items() if k.startswith("internal_")) + energies["contact_mj"]
    assert abs(elastic[0]) < 0.01 * np.abs(elastic).max()
    assert np.abs(energies["balance_error_mj"]).max() < 0.002 * energies["external_mj"].max()
    assert found.overlaps.largest == 0.0
