"""Yarns of a cantilever: laid into the heavy elastica, then relaxed and turned section by section until in equilibrium.

A strip of yarns bends slowly and rattles fast: relaxed from its flat shape it takes a million steps. Here yarns settle
for a while, then the sections turn by the missing moments (:class:`.Sections`), until all moments balance. Yarns slip
without friction: sticking ones would stiffen every turn, and the state would depend on the way to it. Where loops slip
for very long, the yarns get the friction of the fabric after some turns. Loops that are not set would curl the strip; a
couple at the free end keeps it flat without weight.
"""

import time as clock
from dataclasses import dataclass, replace
from math import atan2, ceil, degrees, log

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Array, Frame
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.cantilever.macro_strip import Equilibrium, Sections, StripMount
from knittest.laboratory.strips import cut_piece, node_weights, pitch, wale_course_counts, yarns_across
from knittest.materials.heavy_elastica import heavy_elastica
from knittest.models.boundary import Boundary, new_tally
from knittest.models.meso import build_meso, yarn_contact
from knittest.models.natural_state import rotate_about_x
from knittest.models.yarn_model import YarnModel
from knittest.solve.relaxation import Look, Relaxation, relax
from knittest.solve.state import SILENT, Observer, SimulationCost

#: steps in which yarns and loops settle at first, and between two turns of the sections; most turns
SETTLE, BETWEEN, MOST_TURNS = 7500, 2500, 72
#: times as many steps in a strip without inlays along it: a period of its loops takes up to 40000 steps
OF_LOOPS = 4
#: turns after which yarns rub on each other, and turns without a smaller residual that end it
RUBBING, STALLED = 16, 24
#: share of progress of each of the first settlings, and sections at either end that the curl is not read from
FIRST, ENDS = 0.15, 3
#: deflection by unbalanced moments and error of the root moment, both over that of the weight, in equilibrium; the root
#: settles last, and bends a few millimetres only
BALANCED, ROOT_BALANCED = 0.005, 0.008
#: assumed stiffness of the turns over that of the yarns: too stiff takes more turns, too soft overshoots
STIFFENING_FACTOR = 1.6
#: measured over assumed stiffness of a turn above which the next ones use the measured one: loops stiffen thin inlays
OVERSHOOT_FACTOR = 1.5
#: largest turn [rad] of a section at once, and pitches held behind the edge
LARGEST_TURN, HELD = 0.3, 1


def mount_yarns(
    run: CantileverRun, overhang: float, specimen: int = 0, observer: Observer = SILENT
) -> PreparedSpecimen:
    """Make the strip flat along y, its edge at 0 and its free end a whole number of pitches from its held one."""
    start = clock.perf_counter()
    direction, period = run.rig.direction, pitch(run, run.rig.direction)
    across, along = yarns_across(run, direction, specimen), ceil(overhang / period) + HELD
    piece = cut_piece(run, *wale_course_counts(direction, along, across), specimen, observer)
    paths = piece.paths
    if direction != "warp":
        paths = [replace(p, points=np.column_stack([-p.points[:, 1], p.points[:, 0], p.points[:, 2]])) for p in paths]
    paths = [replace(p, points=p.points - [0.0, along * period - overhang, 0.0]) for p in paths]
    share = run.rig.usual["membrane_share"] if run.rig.membrane_share is None else run.rig.membrane_share
    model = build_meso(run, paths, piece.draws, share, rubbing=False)
    width = across * (run.fabric.wale_spacing if direction == "warp" else run.fabric.course_spacing)
    facts = {"overhang_mm": overhang, "width_mm": width, "area_mm2": width * along * period}
    mounting = StripMount(
        model.position(), node_weights(run.fabric, run.rig.gravity_mm_per_ms2, model, facts["area_mm2"])
    )
    return PreparedSpecimen(model, mounting, clock.perf_counter() - start, piece.table, facts)


@dataclass
class _StripRelaxation:
    """A strip on its way to equilibrium: its sections, damping and loads, and the relaxations so far."""

    prepared: PreparedSpecimen
    run: CantileverRun
    cost: SimulationCost
    curl: float | None

    def __post_init__(self) -> None:
        model, mounting = self.prepared.model, _strip_mount(self.prepared)
        self.dt = self.run.solver.safety * model.critical_step
        boundary = Boundary(model, self.dt)
        mounting.constrain(boundary)
        if self.curl is not None:
            tips = _tips(self.prepared, self.run)
            boundary.gravity(mounting.weight)
            boundary.load(tips, "rx", -self.curl / len(tips))
        self.overlaps = model.prepare()
        self.has_friction = False
        self.drive, self.tally, self.done = boundary.drive(), new_tally(boundary), Relaxation()
        self.last: list[tuple[int, float, float, float]] = []
        self.sections = Sections(mounting.flat, model.mass, self.prepared.facts["overhang_mm"])

    def settle(self, steps: int, look: Look | None = None) -> Array:
        """Relax; return the unbalanced moments [N mm], (n_sections,)."""
        model = self.prepared.model
        steps *= 1 if self.run.fabric.inlays_along(self.run.rig.direction) else OF_LOOPS
        found = relax(model, self.drive, self.tally, self.dt, self.run.rig.tolerance, steps, look=look)
        self.last = [(self.done.steps + row[0], *row[1:]) for row in found.history]
        self.done.steps, self.done.last_chunk = self.done.steps + found.steps, found.last_chunk
        self.cost.steps, self.cost.time_step = self.cost.steps + found.steps, self.dt
        return self.sections.moments(model.position(), model.nodes.force[:, : model.n_nodes].T)

    def rub(self) -> None:
        """Give the yarns the friction of the fabric; until now they slip freely."""
        contact, model = yarn_contact(self.run), self.prepared.model
        assert isinstance(model, YarnModel)
        static = contact.friction if contact.static is None else contact.static
        model.law = model.law._replace(static=static, kinetic=contact.friction)
        self.has_friction = contact.friction > 0.0

    def update_residual(self, moments: Array) -> None:
        """Residual: the tip's deflection by unbalanced moments of one sign over that by the weight."""
        weight = np.zeros((self.prepared.model.n_nodes, 3))
        weight[:, 2] = -_strip_mount(self.prepared).weight
        lever = self.sections.arc[-1] - self.sections.arc
        carried = self.sections.moments(self.prepared.model.position(), weight)
        self.done.residual = float(lever @ np.abs(moments) / (lever @ np.abs(carried)))
        self.done.history += [(steps, self.done.residual, moved, slowest) for steps, _, moved, slowest in self.last]
        error = self.carried() / float(carried[0]) - 1.0
        self.done.converged = self.done.residual < BALANCED and abs(error) < ROOT_BALANCED

    def carried(self) -> float:
        """Moment of the root [N mm] about the edge without that of the curl."""
        mounting = _strip_mount(self.prepared)
        return mounting.root(self.tally.reaction, self.done.last_chunk) - (self.curl or 0.0)

    def turn(self, curvature: Array) -> None:
        """Bend the sections by a ``curvature`` [1/mm], (n_sections,)."""
        model = self.prepared.model
        n = model.n_nodes
        position, turn = self.sections.turn(model.position(), curvature)
        model.nodes.position[:, :n] = position.T
        model.nodes.rotation[:, :n] = rotate_about_x(model.nodes.rotation[:, :n], -turn)


def relax_yarns(
    prepared: PreparedSpecimen, run: CantileverRun, cost: SimulationCost, observer: Observer
) -> Equilibrium:
    """Bend the strip until the moments of all its sections carry the weight beyond them."""
    per_length = run.fabric.area_mass_g_per_mm2 * run.rig.gravity_mm_per_ms2 * prepared.facts["width_mm"]
    overhang, mounting, model = prepared.facts["overhang_mm"], _strip_mount(prepared), prepared.model
    fresh, first = model.state(), Frame(0.0, 0.0, 0.0, mounting.flat, model.fields())
    flat = _StripRelaxation(prepared, run, cost, None)
    observer.overlaps(flat.overlaps)
    curl = -float(flat.settle(SETTLE, _report_from(observer, 0.0))[ENDS:-ENDS].mean())
    model.restore(fresh)
    stiffness = _inlay_stiffness(prepared, run)
    _bend(prepared, overhang, per_length, stiffness)
    course = _StripRelaxation(prepared, run, cost, curl)
    moments, before = course.settle(SETTLE, _report_from(observer, FIRST)), _chord_angle(prepared, run)
    turning, residuals = STIFFENING_FACTOR * stiffness, list[float]()
    for trial in range(MOST_TURNS + 1):
        course.update_residual(moments)
        residuals.append(course.done.residual)
        observer.relaxation_progress(2.0 * FIRST + (1.0 - 2.0 * FIRST) * _progress_share(residuals))
        stalled = trial - max(int(np.argmin(residuals)), RUBBING) >= STALLED
        if course.done.converged or stalled or trial == MOST_TURNS:
            break
        if trial == RUBBING:
            course.rub()
        before = _chord_angle(prepared, run)
        missing, curvature = moments, course.sections.limit_turns(moments / turning, LARGEST_TURN)
        course.turn(curvature)
        moments = course.settle(BETWEEN)
        if trial != RUBBING:
            turning = _next_stiffness(turning, STIFFENING_FACTOR * stiffness, curvature, missing - moments)
    now = model.position()
    weight, angle = mounting.moment(now), _chord_angle(prepared, run)
    frames = (first, Frame(1.0, angle, weight, now, model.fields()))
    return Equilibrium(
        overhang, angle, course.carried(), weight, mounting.curvature(now), course.done, frames, course.done.converged,
        curl, angle - before, has_friction=course.has_friction,
    )  # fmt: skip


def _inlay_stiffness(prepared: PreparedSpecimen, run: CantileverRun) -> float:
    fabric, direction = run.fabric, run.rig.direction
    if len(fabric.inlays_along(direction)) == 1:
        return fabric.inlays_along(direction)[0].bending * len(_tips(prepared, run))
    return fabric.yarn_bending_n_mm(direction) * prepared.facts["width_mm"]


def _report_from(observer: Observer, share: float) -> Look:
    """Report to ``observer`` steps of settling that begin at a ``share`` of the whole."""
    return lambda steps, most: observer.relaxation_progress(share + FIRST * steps / most)


def _progress_share(residuals: list[float]) -> float:
    """Progress from the first residual to that of equilibrium, on a logarithmic scale."""
    first, now = (max(residual / BALANCED, 1.0 + 1e-9) for residual in (residuals[0], min(residuals)))
    return 1.0 - log(now) / log(first)


def _bend(prepared: PreparedSpecimen, overhang: float, weight: float, stiffness: float) -> None:
    """Lay the strip into the heavy elastica; its sections turn rigidly."""
    nodes, flat = prepared.model.nodes, _strip_mount(prepared).flat
    n = len(flat)
    reach, drop, slope = heavy_elastica(flat[:, 1], overhang, weight, stiffness)
    nodes.position[1, :n] = reach + flat[:, 2] * np.sin(slope)
    nodes.position[2, :n] = -drop + flat[:, 2] * np.cos(slope)
    nodes.rotation[:, :n] = rotate_about_x(nodes.rotation[:, :n], -slope)


def _next_stiffness(present: float, usual: float, curvature: Array, changes: Array) -> float:
    """Stiffness [N mm2] for the next turn: ``present``, or the measured one where moments changed too much."""
    shown = float(curvature @ changes) / max(float(curvature @ curvature), 1e-30)
    if shown > OVERSHOOT_FACTOR * present or present > usual:
        return max(STIFFENING_FACTOR * shown, usual)
    return present


def _strip_mount(prepared: PreparedSpecimen) -> StripMount:
    assert isinstance(prepared.mount, StripMount)
    return prepared.mount


def _tips(prepared: PreparedSpecimen, run: CantileverRun) -> NDArray[np.int64]:
    """Free ends of the inlays along the strip; without inlays there, the nodes at its free edge."""
    mesh, systems = prepared.model.mesh, [one.name for one in run.fabric.inlays_along(run.rig.direction)]
    if not systems:
        along = _strip_mount(prepared).flat[:, 1]
        return np.flatnonzero(along >= along.max() - 0.25 * pitch(run, run.rig.direction))
    of = np.isin(mesh.part, [mesh.part_names.index(name) for name in systems])
    cells, yarn = mesh.cells[of], mesh.yarn[of]
    return cells[np.append(yarn[1:] != yarn[:-1], True), 1]


def _chord_angle(prepared: PreparedSpecimen, run: CantileverRun) -> float:
    tips, flat = _tips(prepared, run), _strip_mount(prepared).flat
    now = prepared.model.position()
    return degrees(atan2(float((flat[tips, 2] - now[tips, 2]).mean()), float(now[tips, 1].mean())))
