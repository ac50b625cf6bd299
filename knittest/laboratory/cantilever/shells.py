"""Shells of a cantilever: flat at the start, at rest by dynamic relaxation."""

from math import atan2, degrees

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame
from knittest.laboratory.base import Prepared, fabric_laminate
from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.cantilever.mounting import EDGE, NEAR, TERMS, Mounting, Rest
from knittest.laboratory.weights import weights
from knittest.materials.laminate import enough_for_bending, softened
from knittest.models.boundary import Boundary
from knittest.models.explicit_model import ExplicitModel
from knittest.models.macro import build_rectangle
from knittest.models.readings import new_tally
from knittest.solve.observer import Observer
from knittest.solve.relax import relax
from knittest.solve.state import SimulationCost

Array = NDArray[np.float64]


def mount_shells(run: CantileverRun, overhang: float) -> Prepared:
    """The strip flat, its edge at 0; across, shells are no longer than along, or their hourglass control bends them."""
    size = run.model.macro.element_size_mm
    rows = max(round(overhang / size), 4)
    step = overhang / rows
    y = np.concatenate([[-step], step * np.arange(rows + 1)])
    card, share, width = fabric_laminate(run), run.rig.membrane_share, run.rig.width_mm
    if share is None:
        share = enough_for_bending(card, run.rig.usual["membrane_share"])
    model = build_rectangle(run.fabric, softened(card, share), run.rig.direction, y, width, min(size, step))
    area = width * (overhang + step)
    mounting = Mounting(model.position(), weights(run.fabric, run.rig.gravity_mm_per_ms2, model, area))
    facts = {"overhang_mm": overhang, "width_mm": width, "area_mm2": area, "membrane_share": share}
    return Prepared(model, mounting, facts=facts)


def shells_to_rest(prepared: Prepared, run: CantileverRun, cost: SimulationCost, observer: Observer) -> Rest:
    """Relax under gravity and read the shape."""
    model, mounting = prepared.model, prepared.mount
    assert isinstance(mounting, Mounting)
    dt = run.solver.safety * model.critical_step
    boundary = Boundary(model, dt)
    mounting.constrain(boundary)
    boundary.gravity(mounting.weight)
    observer.overlaps(model.prepare())
    drive, tally = boundary.drive(), new_tally(boundary)
    first = Frame(0.0, 0.0, 0.0, model.position(), model.fields())
    relaxation = relax(model, drive, tally, dt, run.rig.tolerance)
    cost.steps, cost.time_step = cost.steps + relaxation.steps, dt
    now = model.position()
    flat = first.position
    tip = flat[:, 1] >= flat[:, 1].max() - 1e-6
    drop, reach = -(now[tip, 2] - flat[tip, 2]).mean(), now[tip, 1].mean()
    angle, moment = degrees(atan2(drop, reach)), mounting.moment(now)
    frames = (first, Frame(1.0, angle, moment, now, model.fields()))
    root = mounting.root(tally.reaction, relaxation.last_chunk)
    w, x = model.nodes.rotation[:2, : model.n_nodes]
    turns = -2.0 * np.arctan2(x, w)
    return Rest(
        prepared.facts["overhang_mm"], angle, root, moment, root_curvature(flat[:, 1], turns), relaxation, frames,
        relaxation.converged, hourglass=_hourglass(model),
    )  # fmt: skip


def root_curvature(along: Array, turns: Array) -> float:
    """Curvature [1/mm] at the edge of nodes ``along`` the strip [mm] that have turned downwards by ``turns`` [rad],
    (n,) each: the parabola of the curvatures between the rows next to it, free of transverse shear.
    """
    place, row = np.unique(np.round(along[along >= -EDGE], 6), return_inverse=True)
    turn = np.bincount(row, turns[along >= -EDGE]) / np.bincount(row)
    middle, curvature = 0.5 * (place[1:] + place[:-1]), np.diff(turn) / np.diff(place)
    near = max(TERMS, np.count_nonzero(middle < NEAR * place[-1]))
    return float(np.polyfit(middle[:near], curvature[:near], TERMS - 1)[-1])


def _hourglass(model: ExplicitModel) -> float:
    """Energy of the hourglass control over the internal one [-]; of nothing none."""
    stored = model.stored()
    return stored.hourglass / max(float(stored.internal.sum()), 1e-300)
