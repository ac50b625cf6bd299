"""Pairs of nodes of soft yarns that touch, renewed as the yarns move."""

import time as clock
from collections.abc import Callable

import numpy as np

from knittest.base.arrays import Array, Index
from knittest.base.errors import InputError, NumericalError
from knittest.base.history import Overlaps
from knittest.kernels import search
from knittest.kernels.soft_contact import pair_statistics
from knittest.kernels.state import Nodes, SoftPairs
from knittest.models.contact_tracker import ContactTracker, YarnContactGroup
from knittest.models.explicit_model import State, checked_array

#: distance of centre-lines over the diameter of the core below which one yarn is about to pass the other
NEAREST = 0.3
#: way over the outer diameter that pairs may come nearer before the list is renewed
SKIN = 0.15


def empty_pairs(n_nodes: int) -> SoftPairs:
    """No pairs of ``n_nodes`` nodes."""
    none = np.zeros(0)
    return SoftPairs(
        np.zeros((2, 0), np.int64), none, none, np.zeros((3, 0)), np.zeros((3, 0)), np.zeros(n_nodes + 1, np.int64),
        np.zeros(0, np.int64),
    )  # fmt: skip


class SoftTracker(ContactTracker):
    """Pairs of nodes of soft yarns; the list of contacts at points stays empty.

    A pair is kept while it is nearer than the outer diameter and :data:`SKIN`; with it the stretch of its friction.
    """

    def __init__(self, nodes: Nodes, alive: Array, group: YarnContactGroup, name_of: Callable[[int], str]) -> None:
        super().__init__(nodes, alive, group, name_of)
        assert group.soft_law is not None
        self.law = group.soft_law
        self.skin, self.pairs = SKIN * self.law.outer, empty_pairs(group.radius.size)
        self._there = np.full((3, group.radius.size), np.inf)

    def settle(self) -> Overlaps:
        """Find the first pairs; yarns that overlap press each other from the start."""
        self.speed = search.largest_speed(self.nodes)
        self._find_pairs_anew()
        return Overlaps()

    def safe_steps(self, dt: float, most: int, speed: float = 0.0) -> int:
        """Steps, at most ``most``, in which no node moves further than half of the skin."""
        return int(np.clip(0.25 * self.skin / max(self.speed * dt, speed * dt, 1e-12), 1, most))

    def update(self, ahead: float) -> tuple[float, float]:
        """Renew the pairs if the skin could be used up within ``ahead`` [ms]; nothing is given energy."""
        start = clock.perf_counter()
        self.speed = search.largest_speed(self.nodes)
        moved = np.abs(self.nodes.position[:, : self._there.shape[1]] - self._there).max()
        if not moved + self.speed * ahead < 0.28 * self.skin:  # along each axis; half of the skin in any direction
            self._find_pairs_anew()
        self.seconds += clock.perf_counter() - start
        return 0.0, 0.0

    def stored(self) -> tuple[float, Array]:
        """Energy [mJ] of the pairs, and depth (1,) of the deepest beyond the table over the radius of the core [-]."""
        energy, _, least = pair_statistics(self.nodes, self.pairs, self.law)
        depth = max(self.law.least - float(least), 0.0) / float(self.group.radius.min())
        return float(energy), np.array([depth])

    def force_sum(self) -> float:
        """Sum of the forces [N] of the pairs."""
        return float(pair_statistics(self.nodes, self.pairs, self.law)[1])

    def contact_forces(self) -> tuple[Array, Array, Index]:
        """See :meth:`ExplicitModel.contact_forces`."""
        touching = np.flatnonzero((self.pairs.force != 0.0).any(axis=0))
        first, second = self.pairs.node[:, touching]
        x = self.nodes.position
        place = 0.5 * (x[:, first] + x[:, second])
        return place.T, self.pairs.force[:, touching].T, self.group.chain[self.pairs.node[:, touching]].T

    def piercing_fault(self) -> str:
        """Name two yarns whose centre-lines are nearer than :data:`NEAREST` of the core; empty if none are."""
        least = pair_statistics(self.nodes, self.pairs, self.law)[2]
        if least >= NEAREST * 2.0 * float(self.group.radius.min()):
            return ""
        x = self.nodes.position
        apart = np.linalg.norm(x[:, self.pairs.node[0]] - x[:, self.pairs.node[1]], axis=0)
        first, second = self.pairs.node[:, int(np.argmin(apart))]
        return f"{self.name_of(int(first))} and {self.name_of(int(second))} pass through each other (node {int(first)})"

    def state(self) -> State:
        """See :meth:`ContactTracker.state`; adds the pairs."""
        pairs = {f"pairs/{name}": getattr(self.pairs, name).copy() for name in ("node", "spring", "force")}
        return super().state() | pairs | {"there": self._there.copy()}

    def restore(self, state: State) -> None:
        """See :meth:`ContactTracker.restore`."""
        super().restore(state)
        self._there[:] = checked_array(state, "there", self._there.shape)
        node = np.asarray(state["pairs/node"], np.int64)
        if (
            node.ndim != 2
            or len(node) != 2
            or (node.size and not 0 <= node.min() <= node.max() < len(self.group.chain))
        ):
            raise InputError("pairs of soft yarns: they are of another model")
        self.pairs = self._pairs_of(node)
        self.pairs.spring[:] = checked_array(state, "pairs/spring", self.pairs.spring.shape)
        self.pairs.force[:] = checked_array(state, "pairs/force", self.pairs.force.shape)

    def _find_pairs_anew(self) -> None:
        from scipy.spatial import cKDTree

        group, n = self.group, self.group.radius.size
        self._there[:] = self.nodes.position[:, :n]
        if not np.isfinite(self._there).all():
            i = int(np.argmin(np.isfinite(self._there).all(axis=0)))
            raise NumericalError(f"the position of node {i} of {self.name_of(i)} is not finite")
        found = cKDTree(self._there.T).query_pairs(self.law.outer + self.skin, output_type="ndarray")
        first, second = found.min(axis=1), found.max(axis=1)
        alike = group.chain[first] == group.chain[second]
        kept = ~alike | (second - first > group.exclude[first])
        if group.owned is not None:
            kept &= (group.owned[first] > 0.0) | (group.owned[second] > 0.0)
        first, second = first[kept], second[kept]
        order = np.lexsort((second, first))
        before, self.pairs = self.pairs, self._pairs_of(np.stack([first[order], second[order]]))
        self._carry_over(before)
        self.searches += 1

    def _pairs_of(self, node: Index) -> SoftPairs:
        """Pairs of ``node`` (2, n), sorted, without friction and forces."""
        group, count = self.group, node.shape[1]
        share = np.ones(count) if group.owned is None else group.owned[node].mean(axis=0)
        side = 2 * np.tile(np.arange(count), 2) + np.repeat([0, 1], count)
        order = np.argsort(node.ravel(), kind="stable")
        start = np.searchsorted(node.ravel()[order], np.arange(group.radius.size + 1)).astype(np.int64)
        weight = group.length[node].prod(axis=0)
        return SoftPairs(node, weight, share, np.zeros((3, count)), np.zeros((3, count)), start, side[order])

    def _carry_over(self, before: SoftPairs) -> None:
        """Let pairs that were there ``before`` keep the stretch of their friction and their force."""
        n = self.group.radius.size
        old, new = (pairs.node[0] * n + pairs.node[1] for pairs in (before, self.pairs))
        if not old.size:
            return
        place = np.minimum(np.searchsorted(old, new), old.size - 1)
        same = np.flatnonzero(old[place] == new)
        for name in ("spring", "force"):
            getattr(self.pairs, name)[:, same] = getattr(before, name)[:, place[same]]
