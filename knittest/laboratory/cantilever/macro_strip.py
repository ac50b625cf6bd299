"""Bent strip of a cantilever: shells at rest by dynamic relaxation, moments of its sections, its support and loads."""

from dataclasses import dataclass
from math import atan2, degrees

import numpy as np

from knittest.base.history import Array, Frame
from knittest.laboratory.base import PreparedSpecimen, StaticMount, fabric_laminate
from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.strips import node_weights
from knittest.materials.laminate import scale_membrane, share_for_bending
from knittest.models.boundary import Boundary, new_tally
from knittest.models.macro import build_rectangle
from knittest.solve.relaxation import Relaxation, relax
from knittest.solve.state import Observer, SimulationCost

# Sections of a bent strip: their unbalanced moments, and turns that balance them. A strip of yarns bends a thousand
# times more slowly than its loops settle, so relaxation alone would take a million steps. Cantilevers are statically
# determinate: residual forces give the missing moment of every section, and with an assumed stiffness its missing
# curvature. Alternating relaxation and turns of the sections is a two-grid method; its result does not depend on the
# assumed stiffness.

#: distance of sections [mm], about that of yarns
SPACING = 4.0


class Sections:
    """Sections across a strip along y held behind its edge at 0: ``flat`` (n, 3) [mm], ``mass`` (n,), ``overhang``."""

    def __init__(self, flat: Array, mass: Array, overhang: float) -> None:
        self.arc = np.linspace(0.0, overhang, max(round(overhang / SPACING), 8) + 1)
        self._of, self._mass = flat[:, 1], mass
        self._order = np.argsort(self._of, kind="stable")
        self._sorted = self._of[self._order]
        #: nodes that belong to a section: within a distance of it on either side
        step = self.arc[1]
        self._near = [np.flatnonzero(np.abs(self._of - s) < step) for s in self.arc]

    def centres(self, position: Array) -> Array:
        """Centres of mass of the sections (n_sections, 3) [mm]; the first lies at the edge."""
        found = np.array([np.average(position[near], axis=0, weights=self._mass[near]) for near in self._near])
        found[0, 1] = 0.0
        return found

    def moments(self, position: Array, force: Array) -> Array:
        """Moment [N mm] of ``force`` (n, 3) [N] on the nodes beyond each section about it, downwards, (n_sections,)."""
        y, z = position[self._order, 1], position[self._order, 2]
        fy, fz = force[self._order, 1], force[self._order, 2]
        beyond = np.searchsorted(self._sorted, np.maximum(self.arc, 1e-6), side="right")
        sums = [np.append(np.cumsum(v[::-1])[::-1], 0.0)[beyond] for v in (z * fy - y * fz, fy, fz)]
        centre = self.centres(position)
        return np.asarray(sums[0] - centre[:, 2] * sums[1] + centre[:, 1] * sums[2])

    def limit_turns(self, curvature: Array, most: float) -> Array:
        """``curvature`` [1/mm], (n_sections,), scaled down so that no section turns by more than ``most`` [rad]."""
        largest = float(np.abs(self._turns(curvature)).max())
        return curvature * min(1.0, most / max(largest, 1e-30))

    def _turns(self, curvature: Array) -> Array:
        """Turn [rad] of each section by the ``curvature`` [1/mm] up to it, (n_sections,)."""
        return np.append(0.0, np.cumsum(0.5 * self.arc[1] * (curvature[1:] + curvature[:-1])))

    def turn(self, position: Array, curvature: Array) -> tuple[Array, Array]:
        """Positions (n, 3) [mm] and turns downwards (n,) [rad] of nodes after rigid sections bent by ``curvature``."""
        turn = self._turns(curvature)
        before = self.centres(position)
        chords = _turn_down(np.diff(before, axis=0), 0.5 * (turn[1:] + turn[:-1]))
        after = before[0] + np.vstack([np.zeros(3), np.cumsum(chords, axis=0)])
        of = np.interp(self._of, self.arc, turn)
        old, new = (np.column_stack([np.interp(self._of, self.arc, c) for c in line.T]) for line in (before, after))
        free = self._of > 0.0
        moved = np.where(free[:, None], new + _turn_down(position - old, of), position)
        return moved, np.where(free, of, 0.0)


def _turn_down(vector: Array, angle: Array) -> Array:
    """``vector`` (n, 3) turned from y towards -z by ``angle`` (n,) [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([vector[:, 0], c * vector[:, 1] + s * vector[:, 2], c * vector[:, 2] - s * vector[:, 1]])


#: nodes up to here [mm] are held
EDGE = 1e-6
#: share of the overhang that gives the curvature of the root, and terms of the fit
NEAR, TERMS = 0.25, 3


@dataclass
class Equilibrium:
    """A strip in equilibrium: chord angle [deg], moments of root and weight about the edge [N mm], curvature [1/mm]."""

    overhang: float
    angle: float
    root_moment: float
    weight_moment: float
    curvature: float
    relaxation: Relaxation
    frames: tuple[Frame, Frame]
    converged: bool
    #: moment [N mm] that holds the strip flat without weight, and last change of the angle [deg]
    curl: float = 0.0
    drift: float = 0.0
    #: energy of the hourglass control of shells over the internal one [-]
    hourglass: float = 0.0
    #: whether yarns got their friction on the way
    has_friction: bool = False


class StripMount(StaticMount):
    """A strip along y, held behind its edge at 0; ``flat`` positions [mm], (n, 3), and ``weight`` [N] of its nodes."""

    def __init__(self, flat: Array, weight: Array) -> None:
        self.flat, self.weight = flat, weight

    def constrain(self, boundary: Boundary) -> None:
        """Hold the root; the reactions add up to its moment about the edge (scales are lever arms)."""
        along, height = self.flat[:, 1], self.flat[:, 2]
        held = np.flatnonzero(along <= EDGE)
        boundary.move(held, "z", scale=along[held])
        boundary.move(held, "y", scale=-height[held])
        boundary.move(held, ["rx"])
        boundary.move(held, ["x", "ry", "rz"])

    def moment(self, now: Array) -> float:
        """Moment of the weight about the edge [N mm] at positions ``now`` (n, 3)."""
        free = self.flat[:, 1] > EDGE
        return float(np.sum(self.weight[free] * now[free, 1]))

    def root(self, reaction: Array, steps: int) -> float:
        """Moment of the strip at the edge [N mm] from reactions (PARTITIONS, n_groups) summed over ``steps``."""
        held = self.flat[:, 1] <= EDGE
        return float(reaction[:, :3].sum()) / steps - float(self.weight[held] @ self.flat[held, 1])

    def curvature(self, now: Array) -> float:
        """Curvature at the edge [1/mm] of the mean deflection, by terms of the elastica."""
        along, drop = self.flat[:, 1], self.flat[:, 2] - now[:, 2]
        rows = np.unique(np.round(along[along > EDGE], 6))
        near = (along > EDGE) & ((along < NEAR * along.max()) | (along < rows[:TERMS][-1] + EDGE))
        s = along[near]
        basis = np.column_stack([0.5 * s**2, s**3, s**4])
        return float(np.linalg.lstsq(basis, drop[near], rcond=None)[0][0])


def mount_shells(run: CantileverRun, overhang: float) -> PreparedSpecimen:
    """Make the strip flat, its edge at 0; shells are no longer across than along, or hourglass control bends them."""
    size = run.model.macro.element_size_mm
    rows = max(round(overhang / size), 4)
    step = overhang / rows
    y = np.concatenate([[-step], step * np.arange(rows + 1)])
    card, share, width = fabric_laminate(run), run.rig.membrane_share, run.rig.width_mm
    if share is None:
        share = share_for_bending(card, run.rig.usual["membrane_share"])
    model = build_rectangle(run.fabric, scale_membrane(card, share), run.rig.direction, y, width, min(size, step))
    area = width * (overhang + step)
    mounting = StripMount(model.position(), node_weights(run.fabric, run.rig.gravity_mm_per_ms2, model, area))
    facts = {"overhang_mm": overhang, "width_mm": width, "area_mm2": area, "membrane_share": share}
    return PreparedSpecimen(model, mounting, facts=facts)


def relax_shells(
    prepared: PreparedSpecimen, run: CantileverRun, cost: SimulationCost, observer: Observer
) -> Equilibrium:
    """Find the equilibrium of shells under gravity."""
    model, mounting = prepared.model, prepared.mount
    assert isinstance(mounting, StripMount)
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
    turns, stored = -2.0 * np.arctan2(x, w), model.stored_energies()
    return Equilibrium(
        prepared.facts["overhang_mm"], angle, root, moment, root_curvature(flat[:, 1], turns), relaxation, frames,
        relaxation.converged, hourglass=stored.hourglass / max(float(stored.internal.sum()), 1e-300),
    )  # fmt: skip


def root_curvature(along: Array, turns: Array) -> float:
    """Curvature [1/mm] at the edge of nodes ``along`` [mm] with turns down [rad], (n,), without transverse shear."""
    place, row = np.unique(np.round(along[along >= -EDGE], 6), return_inverse=True)
    turn = np.bincount(row, turns[along >= -EDGE]) / np.bincount(row)
    middle, curvature = 0.5 * (place[1:] + place[:-1]), np.diff(turn) / np.diff(place)
    near = max(TERMS, np.count_nonzero(middle < NEAR * place[-1]))
    return float(np.polyfit(middle[:near], curvature[:near], TERMS - 1)[-1])
