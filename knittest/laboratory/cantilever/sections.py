"""Sections of a bent strip: the moment that is out of balance at each, and turns that balance it.

A strip of yarns bends a thousand times more slowly than its loops settle, so relaxation alone would take a million
steps. Cantilevers are statically determinate: forces that are out of balance give the missing moment of every section,
and the missing moment over an assumed stiffness its missing curvature. Relaxing the yarns for a while and turning the
sections by that in turns is a two-grid method, whose result does not depend on the assumed stiffness.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: distance of sections [mm], about that of yarns
SPACING = 4.0


class Sections:
    """Sections across a strip along y that is held behind its edge at 0.

    ``flat`` (n, 3) [mm] the nodes when it lay flat, their ``mass`` (n,) [g] and the ``overhang`` [mm].
    """

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
        """Moment [N mm] that ``force`` (n, 3) [N] on the nodes beyond each section has about it; downwards is positive.

        (n_sections,); nodes at an edge belong to the piece before it.
        """
        y, z = position[self._order, 1], position[self._order, 2]
        fy, fz = force[self._order, 1], force[self._order, 2]
        beyond = np.searchsorted(self._sorted, np.maximum(self.arc, 1e-6), side="right")
        sums = [np.append(np.cumsum(v[::-1])[::-1], 0.0)[beyond] for v in (z * fy - y * fz, fy, fz)]
        centre = self.centres(position)
        moments: Array = sums[0] - centre[:, 2] * sums[1] + centre[:, 1] * sums[2]
        return moments

    def limited(self, curvature: Array, most: float) -> Array:
        """``curvature`` [1/mm], (n_sections,), scaled down so that no section turns by more than ``most`` [rad]."""
        largest = float(np.abs(self._turns(curvature)).max())
        return curvature * min(1.0, most / max(largest, 1e-30))

    def _turns(self, curvature: Array) -> Array:
        """Turn [rad] of each section by the ``curvature`` [1/mm] up to it, (n_sections,)."""
        return np.append(0.0, np.cumsum(0.5 * self.arc[1] * (curvature[1:] + curvature[:-1])))

    def turned(self, position: Array, curvature: Array) -> tuple[Array, Array]:
        """Positions (n, 3) [mm] and turns downwards (n,) [rad] of nodes after sections bent by ``curvature`` [1/mm].

        ``curvature`` (n_sections,); sections turn rigidly and keep their distances, the edge stays.
        """
        turn = self._turns(curvature)
        before = self.centres(position)
        chords = _down(np.diff(before, axis=0), 0.5 * (turn[1:] + turn[:-1]))
        after = before[0] + np.vstack([np.zeros(3), np.cumsum(chords, axis=0)])
        of = np.interp(self._of, self.arc, turn)
        old, new = (np.column_stack([np.interp(self._of, self.arc, c) for c in line.T]) for line in (before, after))
        free = self._of > 0.0
        moved = np.where(free[:, None], new + _down(position - old, of), position)
        return moved, np.where(free, of, 0.0)


def _down(vector: Array, angle: Array) -> Array:
    """``vector`` (n, 3) turned from y towards -z by ``angle`` (n,) [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([vector[:, 0], c * vector[:, 1] + s * vector[:, 2], c * vector[:, 2] - s * vector[:, 1]])
