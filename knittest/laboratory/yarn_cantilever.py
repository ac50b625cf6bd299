"""Yarns of a cantilever: bent at once to the heavy elastica whose stiffness is that of the yarns themselves.

A strip of yarns bends slowly and rattles fast: relaxed from its flat shape it takes a million steps. Here it is laid
into the shape of the elastica of an assumed stiffness, sections turned rigidly, and relaxed for as long as yarns and
loops need to settle, in which the strip as a whole hardly moves. The moment that the root then carries over that of
the weight corrects the stiffness, and so on until both agree. Loops that are not set in their shape would curl the
strip; it lies flat without weight, as a couple at the free end sees to.
"""

import time as clock
from dataclasses import replace
from math import atan2, ceil, degrees

import numpy as np
from numpy.typing import NDArray

from knittest.config.run import CantileverRun
from knittest.history import Frame
from knittest.laboratory.base import Phase, Prepared
from knittest.laboratory.heavy_elastica import heavy_elastica
from knittest.laboratory.mounting import Mounting, Rest, root_moment, weights
from knittest.laboratory.strips import cut, pitch, yarns_across
from knittest.models.boundary import Boundary, new_tally
from knittest.models.meso import build_meso
from knittest.models.natural_state import turned_about_x
from knittest.relaxation import Relaxation, relax
from knittest.simulation import SimulationCost

Array = NDArray[np.float64]

#: steps in which yarns and loops settle, and most shapes tried
SETTLE, MOST_SHAPES = 10_000, 8
#: largest difference of the root's moment from that of the weight at which a shape is the strip's own
AGREED = 0.005
#: pitches held behind the edge
HELD = 1


def mount_yarns(run: CantileverRun, overhang: float, specimen: int = 0, phase: Phase | None = None) -> Prepared:
    """The strip flat along y, its edge at 0 and its free end a whole number of pitches from its held one."""
    start = clock.perf_counter()
    direction, period = run.rig.direction, pitch(run, run.rig.direction)
    across, along = yarns_across(run, direction, specimen), ceil(overhang / period) + HELD
    n_wales, n_courses = (across, along) if direction == "warp" else (along, across)
    piece = cut(run, n_wales, n_courses, specimen, phase)
    edge = along * period - overhang
    paths = [replace(p, points=_along_y(p.points, direction, edge)) for p in piece.paths]
    model = build_meso(run, paths, piece.draws, run.rig.membrane_share)
    width = across * (run.fabric.wale_spacing if direction == "warp" else run.fabric.course_spacing)
    facts = {"overhang_mm": overhang, "width_mm": width, "area_mm2": width * along * period}
    mounting = Mounting(model.position(), weights(run, model, facts["area_mm2"]))
    return Prepared(model, mounting, clock.perf_counter() - start, piece.table, facts)


def _along_y(points: Array, direction: str, edge: float) -> Array:
    turned = points if direction == "warp" else np.column_stack([-points[:, 1], points[:, 0], points[:, 2]])
    return turned - [0.0, edge, 0.0]


def yarns_to_rest(prepared: Prepared, run: CantileverRun, cost: SimulationCost) -> Rest:
    """Find the shape whose root carries the weight."""
    per_length = run.fabric.kernel("area_mass") * run.rig.kernel("gravity") * prepared.facts["width_mm"]
    overhang = prepared.facts["overhang_mm"]
    fresh = prepared.model.state()
    mounting = _mounting(prepared)
    curl = _settle(prepared, run, cost)[1]
    stiffness = run.fabric.reinforcing.kernel("bending_stiffness", run.rig.direction) * len(_tips(prepared, run))
    for trial in range(MOST_SHAPES):
        prepared.model.restore(fresh)
        _bend(prepared, overhang, per_length, stiffness)
        before = _angle(prepared, run)
        relaxation, root = _settle(prepared, run, cost, curl)
        now = prepared.model.position()
        carried, moment = root - curl, mounting.moment(now)
        agreed = abs(carried / moment - 1.0) < AGREED
        if agreed or trial == MOST_SHAPES - 1:
            break
        stiffness *= carried / moment
    angle = _angle(prepared, run)
    frames = (Frame(0.0, 0.0, 0.0, mounting.flat, {}), Frame(1.0, angle, moment, now, prepared.model.fields()))
    return Rest(
        overhang, angle, carried, moment, mounting.curvature(now), relaxation, frames, agreed, curl, angle - before
    )


def _settle(
    prepared: Prepared, run: CantileverRun, cost: SimulationCost, curl: float | None = None
) -> tuple[Relaxation, float]:
    """Relax the strip for a while; returns the root's moment too [N mm].

    Under its weight and with the couple that holds its ``curl`` [N mm], or with neither while that is not known.
    """
    model, mounting = prepared.model, _mounting(prepared)
    dt = run.solver.safety * model.critical_step
    boundary = Boundary(model, dt)
    mounting.constrain(boundary)
    if curl is not None:
        tips = _tips(prepared, run)
        boundary.gravity(mounting.weight)
        boundary.load(tips, "rx", -curl / len(tips))
    model.prepare()
    drive, tally = boundary.drive(), new_tally(boundary)
    relaxation = relax(model, drive, tally, dt, run.rig.tolerance, SETTLE)
    cost.steps, cost.time_step = cost.steps + relaxation.steps, dt
    return relaxation, root_moment(tally.reaction, relaxation.last_chunk)


def _bend(prepared: Prepared, overhang: float, weight: float, stiffness: float) -> None:
    """Lay the strip into the heavy elastica; its sections turn rigidly."""
    nodes, flat = prepared.model.nodes, _mounting(prepared).flat
    n = len(flat)
    reach, drop, slope = heavy_elastica(flat[:, 1], overhang, weight, stiffness)
    nodes.position[1, :n] = reach + flat[:, 2] * np.sin(slope)
    nodes.position[2, :n] = -drop + flat[:, 2] * np.cos(slope)
    nodes.rotation[:, :n] = turned_about_x(nodes.rotation[:, :n], -slope)


def _mounting(prepared: Prepared) -> Mounting:
    assert isinstance(prepared.rig, Mounting)
    return prepared.rig


def _tips(prepared: Prepared, run: CantileverRun) -> NDArray[np.int64]:
    """Nodes at the free ends of the yarns along the strip."""
    mesh = prepared.model.mesh
    of = mesh.part == mesh.part_names.index(run.rig.direction)
    cells, yarn = mesh.cells[of], mesh.yarn[of]
    return cells[np.append(yarn[1:] != yarn[:-1], True), 1]


def _angle(prepared: Prepared, run: CantileverRun) -> float:
    """Chord angle [deg] from the edge to the free ends."""
    tips, flat = _tips(prepared, run), _mounting(prepared).flat
    now = prepared.model.position()
    return degrees(atan2(float((flat[tips, 2] - now[tips, 2]).mean()), float(now[tips, 1].mean())))
