"""Contacts of sheets with themselves and each other, kept current as they move, and the neighbours of shells."""

import time as clock
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from knittest.base.arrays import Array, Index
from knittest.base.errors import InputError, NumericalError
from knittest.base.history import OVERLAP_COUNTS, Overlaps
from knittest.kernels import search, sheet_search
from knittest.kernels.sheet_surface import SheetContacts, SheetLaw, SheetMesh, empty_contacts
from knittest.kernels.shell_state import Shells
from knittest.kernels.state import Nodes, Partitions
from knittest.models.explicit_model import State, arrays_of, checked_array, put_back


def edge_neighbours(cells: Index) -> NDArray[np.int32]:
    """For edge c of shell e, from corner c to c + 1: 4 e' + c' of the same edge of its neighbour, -1 at a free edge.

    ``cells`` (n_el, 4). Raises :class:`InputError` for more than two shells at an edge, or neighbours that turn in
    opposite senses: such a surface has no sides.
    """
    start, end = cells.ravel(), np.roll(cells, -1, axis=1).ravel()
    key = np.minimum(start, end) * (int(cells.max()) + 1) + np.maximum(start, end)
    order = np.argsort(key, kind="stable")
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    if (count > 2).any():
        edge = order[first[np.argmax(count)]]
        raise InputError(f"more than two shells meet between nodes {start[edge]} and {end[edge]}: expected one or two")
    one, other = order[first[count == 2]], order[first[count == 2] + 1]
    if (wrong := start[one] == start[other]).any():
        a, b = one[np.argmax(wrong)] // 4, other[np.argmax(wrong)] // 4
        raise InputError(f"shells {a} and {b} have opposite orientation; order the corners of all shells in one sense")
    found = np.full(cells.size, -1)
    found[one], found[other] = other, one
    return np.ascontiguousarray(found.reshape(cells.shape).astype(np.int32))


def near_shells(points: Array, cells: Index, distance: float) -> tuple[Index, NDArray[np.int32]]:
    """Shells that each node can reach along the sheet without leaving a ball of radius ``distance`` [mm] round it.

    ``points`` (n, 3) [mm], ``cells`` (n_el, 4). Starts (n + 1,) and shell numbers as compressed rows; those round the
    node are always among them.
    """
    n, n_el = len(points), len(cells)
    incidence = sparse.csr_matrix((np.ones(4 * n_el), (cells.ravel(), np.repeat(np.arange(n_el), 4))), (n, n_el))
    adjacent = (incidence @ incidence.T).astype(bool)
    ball, size = sparse.identity(n, dtype=bool, format="csr"), 0
    while ball.nnz > size:
        size = ball.nnz
        pairs = (ball @ adjacent).tocoo()
        inside = np.linalg.norm(points[pairs.row] - points[pairs.col], axis=1) <= distance
        inside |= pairs.row == pairs.col
        rows = (np.ones(int(inside.sum()), bool), (pairs.row[inside], pairs.col[inside]))
        ball = sparse.csr_matrix(rows, (n, n))
    near = sparse.csr_matrix(ball.astype(float) @ incidence)
    return near.indptr.astype(np.int64), near.indices.astype(np.int32)


#: penalty of a node over m / dt^2, dt the step. A node between two sheets, as node and corner on both faces, gets eight
#: times it, below the 4 (1 - 0.9^2) = 0.76 that a step of 0.9 leaves; at a quarter of that the energy that an impact
#: loses within its first and last step stays below a percent, and sheets still penetrate by micrometres only. Where it
#: sticks on both faces, arms and damping may bring the quarter to one and a half: not counted, as friction bounds it
STIFFNESS = 0.0243
#: share of critical damping of a touching node
DAMPING = 0.05
#: distance along the sheet within which it does not touch itself, over the thickness: a hairpin of two layers in touch
#: is a half circle of pi / 2 thicknesses
NEIGHBOURS = 1.6
#: gap up to which contacts are tracked, over the thickness
SKIN = 0.5
#: fewest steps between two looks at the contacts
LEAST_STEPS = 5
#: overlap at the start, over half the thickness, above which the geometry is rejected; number of pairs in the message
MAX_OVERLAP, LISTED = 0.20, 5


@dataclass(frozen=True)
class SheetContact:
    """Coulomb ``friction`` [-] of sheet on sheet; ``static_friction`` before a contact slips, the same if not given.

    ``safety`` is the step over the critical one for which the penalty is made: a shorter step bears a stiffer contact.
    """

    friction: float = 0.0
    static_friction: float | None = None
    safety: float = 0.9


class SheetTracker:
    """Contacts of the nodes of one model with its shells of ``thickness`` [mm]; ``mass`` [g] (n_nodes,), ``step`` the
    critical one [ms]. Lists grow when they overflow, nothing is dropped.
    """

    def __init__(
        self, nodes: Nodes, shells: Shells, parts: Partitions, cells: Index, mass: Array, step: float,
        thickness: float, contact: SheetContact,
    ) -> None:  # fmt: skip
        n, n_el = mass.size, len(cells)
        self.nodes, self.shells = nodes, shells
        owner = np.searchsorted(parts.node, np.arange(n), side="right") - 1
        near = near_shells(nodes.position[:, :n].T, cells, NEIGHBOURS * thickness)
        step *= contact.safety
        self.mesh = SheetMesh(edge_neighbours(cells), owner, STIFFNESS * mass / step**2, *near)
        static = contact.friction if contact.static_friction is None else contact.static_friction
        viscous = 2.0 * DAMPING * step / np.sqrt(STIFFNESS)
        self.law = SheetLaw(float(thickness), float(viscous), float(static), float(contact.friction))
        self.skin = SKIN * thickness
        self.contacts, self._spare, self.count = empty_contacts(64), empty_contacts(64), 0
        self._centre, self._half = np.zeros((3, n_el)), np.zeros(n_el)
        self._order, self._shell_moved = np.zeros(n_el, np.int64), np.zeros(n_el, np.bool_)
        self._since, self._moved = np.full((3, n), np.inf), np.zeros(n, np.bool_)
        self.speed, self.searches, self.seconds = 0.0, 0, 0.0

    def settle(self) -> Overlaps:
        """Find the first contacts; returns what overlaps, which starts free of force.

        Raises :class:`InputError` naming the worst pairs when an overlap exceeds :data:`MAX_OVERLAP`.
        """
        self._moved[:] = True
        self.speed = search.largest_speed(self.nodes)
        self._find_contacts()
        c, half = self.contacts, 0.5 * self.law.thickness
        inside = (c.uv[:, : self.count] > 0.0) & (c.uv[:, : self.count] < 1.0)  # lips of a slit are no overlap
        share = np.where(np.all(inside, axis=0), (self.law.thickness - c.gap[: self.count]) / half, 0.0)
        worst = np.argsort(-share, kind="stable")[:LISTED]
        named = {int(k): self._describe(int(k), float(share[k])) for k in worst if share[k] > OVERLAP_COUNTS}
        if len(share) and share[worst[0]] > MAX_OVERLAP:
            raise InputError(
                f"initial overlap of shells exceeds {100 * MAX_OVERLAP:g} % of half the thickness; worst pairs: "
                + "; ".join(text for k, text in named.items() if share[k] > MAX_OVERLAP)
            )
        return Overlaps(int((share > OVERLAP_COUNTS).sum()), float(share.max(initial=0.0)), tuple(named.values()))

    def _describe(self, contact: int, share: float) -> str:
        i, e = int(self.contacts.node[contact]), int(self.contacts.shell[contact])
        x, y, z = self.nodes.position[:, i]
        return f"node {i} and shell {e} at ({x:.1f}, {y:.1f}, {z:.1f}) mm by {100 * share:.1f} %"

    def safe_steps(self, dt: float, most: int, speed: float = 0.0) -> int:
        """Steps, at most ``most``, in which no gap can close by more than the skin.

        Nodes move at the last speed seen, or at ``speed`` [mm/ms] if that is larger.
        """
        return int(np.clip(0.4 * self.skin / max(self.speed * dt, speed * dt, 1e-12), LEAST_STEPS, most))

    def update(self, ahead: float) -> None:
        """Renew contacts whose skin could be used up within ``ahead`` [ms]."""
        start = clock.perf_counter()
        count, self.speed = search.flag_moved(self.nodes, self._since, ahead, search.REACHED * self.skin, self._moved)
        if count:
            self._find_contacts()
        self.seconds += clock.perf_counter() - start

    @property
    def arguments(self) -> tuple[SheetMesh, SheetContacts, int, SheetLaw]:
        """Arguments of the kernel."""
        return self.mesh, self.contacts, self.count, self.law

    def contact_force_sum(self) -> float:
        """Sum of the contact forces [N]."""
        touching = self.contacts.owners[: self.count] != 0
        return float(np.linalg.norm(self.contacts.force[:, : self.count], axis=0)[touching].sum())

    def diagnose(self) -> str:
        """Name a node that has passed through a shell; empty if none has."""
        c = self.contacts
        through = np.flatnonzero((c.owners[: self.count] != 0) & (c.gap[: self.count] < 0.0))
        return f"node {c.node[through[0]]} has passed through shell {c.shell[through[0]]}" if len(through) else ""

    def state(self) -> State:
        """Contacts in use, where every node was last looked at, and the speed that sets the next look."""
        counts = np.array([self.count, self.contacts.node.size, self._spare.node.size, self.searches])
        return arrays_of("contacts", self._used_contacts(), SheetContacts._fields) | {
            "since": self._since.copy(), "speed": np.array(self.speed), "counts": counts,
        }  # fmt: skip

    def restore(self, state: State) -> None:
        """Put back what :meth:`state` gave; raises :class:`InputError` if it is another model's."""
        self.count, capacity, spare, self.searches = (int(v) for v in checked_array(state, "counts", (4,)))
        self.contacts, self._spare = empty_contacts(capacity), empty_contacts(spare)
        put_back(state, "contacts", self._used_contacts(), SheetContacts._fields)
        self._since[:] = checked_array(state, "since", self._since.shape)
        self.speed = float(checked_array(state, "speed", ()))

    def _used_contacts(self) -> SheetContacts:
        return SheetContacts(*(column[..., : self.count] for column in self.contacts))  # type: ignore[arg-type]

    def _find_contacts(self) -> None:
        """Search where nodes moved and renew the list; it grows when it overflows."""
        n = self._moved.size
        position, conn = self.nodes.position[:, :n], self.shells.conn
        if not np.isfinite(position).all():
            i = int(np.argmin(np.isfinite(position).all(axis=0)))
            raise NumericalError(f"the position of node {i} is not finite")
        sheet_search.shell_centres(self.nodes.position, conn, self._centre, self._half)
        cell = float(self._half.max()) + self.law.thickness + self.skin
        low = position.min(axis=1)
        shape = ((position.max(axis=1) - low) / cell).astype(np.int64) + 1
        head, active = np.zeros(int(shape.prod()) + 1, np.int64), np.zeros(int(shape.prod()), np.bool_)
        everywhere = np.ones(self._half.size, np.bool_)
        cell_of = search.fill_cells(*self._centre, everywhere, cell, low, shape, head, self._order)
        sheet_search.mark_cells(self._moved, conn, cell_of, shape, self._shell_moved, active)
        if self._spare.node.size < self.count:
            self._spare = empty_contacts(self.contacts.node.size)
        while True:
            needed = sheet_search.find_sheet_contacts(
                self.nodes, self.shells, self.mesh, self._moved, self._shell_moved, active,
                (cell, low, shape, head, self._order), self._centre, self._half, self.law, self.skin,
                self.contacts, self.count, self._spare,
            )  # fmt: skip
            if needed <= self._spare.node.size:
                break
            self._spare = empty_contacts(needed + needed // 4)
        self.contacts, self._spare, self.count = self._spare, self.contacts, needed
        self._since[:, self._moved] = position[:, self._moved]
        self.searches += 1
