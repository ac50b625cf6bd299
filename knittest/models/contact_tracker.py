"""List of the yarn contacts, renewed as the yarns move."""

import time as clock
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from knittest.base.arrays import Array, Flags, Index
from knittest.base.errors import InputError, NumericalError
from knittest.base.history import OVERLAP_COUNTS, Overlaps
from knittest.kernels import search
from knittest.kernels.line_contact import MOST, Pieces, flag_other_kinds, mark_found, mark_tracked
from knittest.kernels.pair_search import Cells, find_pairs
from knittest.kernels.section_blocks import COLUMNS, mark_ellipses, place_ellipses, turn_sections
from knittest.kernels.state import ContactLaw, Contacts, Images, Nodes, SoftLaw
from knittest.kernels.vec import PARTITIONS
from knittest.models.explicit_model import State, arrays_of, checked_array, put_back
from knittest.models.image_contacts import masters, share_states

#: fields of :class:`Contacts` that belong to nodes, those of them that change where sections flatten, all others
OF_NODES = ("upright", "turned", "square", "excess", "shape")
SHAPES = ("square", "excess", "shape")
OF_CONTACTS = tuple(name for name in Contacts._fields if name not in OF_NODES)
#: gap up to which contacts are tracked [mm]
CONTACT_SKIN = 0.1
#: share of the skin that the strain of the affine motion may close before all pieces are searched
STRAIN_SHARE = 0.1
#: number of nodes, about, to which the affine motion is fitted, and the length [mm] of :func:`search.motion_basis`
FIT_NODES, SMOOTHING = 500, 1.0
#: fewest steps between two looks at the contacts, however fast yarns recoil
LEAST_STEPS = 5
#: overlap at the start, over the smaller radius, above which the geometry is rejected
MAX_OVERLAP = 0.20
#: overlapping pairs that are named
LISTED = 5
#: overlap over the smaller radius, beyond that of the start, that may stay without force
LEFT_FREE = 0.01
#: time in which deeper overlap without force falls to 1 / e of itself [ms], and the most of it that is given force in
#: one update, over the smaller radius
RECOVERY, PORTION = 0.02, 0.02
#: largest portion in a periodic cell and of soft yarns, which have little energy. Contacts between thin loops are
#: 0.00005 to 0.001 deep: portions of 0.002 gave as much energy as the cell had. Where plates press soft yarns together,
#: it is a share of the mean depth: portions that stay small are slower than the plates
SMALL_PORTION, DEPTH_SHARE = 2e-4, 0.5


def _empty_contacts(capacity: int, group: "YarnContactGroup") -> Contacts:
    elliptic = capacity if group.square.size else 0
    shift, other = (np.zeros((3, elliptic)) for _ in range(2))
    pair, triple = (np.zeros((2, capacity)), [np.zeros((3, capacity)) for _ in range(5)])
    slipping, reach, arm, line, twist, couple = (np.zeros(capacity) for _ in range(6))
    return Contacts(
        np.zeros((2, capacity), np.int64), pair, triple[0], triple[1], slipping, reach, arm, line, triple[2],
        twist, couple, np.zeros((2, capacity)), np.zeros(2 * capacity, np.int64), np.zeros(PARTITIONS + 1, np.int64),
        np.ones(capacity), triple[3], triple[4], np.zeros(capacity), shift, other, np.zeros(elliptic), group.upright,
        group.turned, group.square, group.excess, group.shape,
    )  # fmt: skip


def _pair_storage(capacity: int) -> tuple[Index, Array]:
    """Work space for the pairs of every share of the pieces."""
    return np.zeros((PARTITIONS, capacity, 2), np.int64), np.zeros((PARTITIONS, capacity, COLUMNS))


def _used_contacts(contacts: Contacts, count: int) -> Contacts:
    columns = {name: getattr(contacts, name)[..., :count] for name in Contacts._fields}
    whole = {name: getattr(contacts, name) for name in (*OF_NODES, "half_start")}
    return Contacts(**columns | whole | {"half": contacts.half[: 2 * count]})


@dataclass
class YarnContactGroup:
    """Input of the search, each (n_nodes,): radius and half piece length [mm], pieces along the same yarn that never
    touch, where a spline piece is, chain and part numbers, whether a piece is so near the end of its yarn that it is
    ``cut``, and does not press another that is; ``node_cut`` first nodes of the partitions; ``law`` of all
    pairs, ``levers`` (2, n_parts, n_parts) of their friction moments. ``bound`` radius around the section [mm], that of
    an ellipse more than its half height, ``radius``; sections of nodes as in :class:`Contacts`, empty if all are round
    (``shape``: if all are rigid).
    ``pressed`` where overlaps at the start shall carry force. ``compliant``: see :class:`YarnContact`.

    In a periodic cell ``owned`` (n_nodes,) is 1 for its nodes and 0 for images, and contacts are looked for with the
    pieces ``near`` (n_nodes,), which touch a node of the cell, whose ``images`` have copies of them; none elsewhere.

    Yarns with a shell touch by ``soft_law``, with the ``length`` (n_nodes,) of yarn [mm] that each node stands for.
    """

    radius: Array
    half_piece: Array
    exclude: Index
    is_piece: Flags
    chain: Index
    cut: Flags
    node_cut: Index
    law: ContactLaw
    part: Index
    levers: Array
    bound: Array
    upright: Array
    turned: Array
    square: Array
    excess: Array
    shape: Array
    owned: Array | None = None
    near: Flags | None = None
    images: Images | None = None
    pressed: bool = False
    compliant: bool = False
    soft_law: SoftLaw | None = None
    length: Array = field(default_factory=lambda: np.zeros(0))


class ContactTracker:
    """Contacts of one model, renewed by displacement; lists grow when they overflow, nothing is dropped.

    Displacements are relative to an affine motion x = A X + a of the specimen. X are the positions at the last search
    of all pieces. A and a are fitted anew at each update; the bound below holds for any A and a.

    Let W be the vector between the closest points of two pieces at X. Two parts close their gap:

    - The change of (A - 1) W. It is at most twice the largest |A - 1| since that search times |W|. Pieces that could
      touch have a |W| of at most the sum of radii and both relative displacements, over 1 - |A - 1|. If this part
      exceeds :data:`STRAIN_SHARE` of the skin, all pieces are searched.
    - The relative displacements of both pieces. They have the rest of the skin. A node that exceeds its share causes a
      search of the pieces that moved.

    Nodes are taken to keep their velocity until the next update. In a periodic cell A is 1 and a is 0.
    """

    def __init__(self, nodes: Nodes, alive: Array, group: YarnContactGroup, name_of: Callable[[int], str]) -> None:
        n = group.radius.size
        self.nodes, self.alive, self.group, self.name_of = nodes, alive, group, name_of
        self.contacts, self._spare, self.count = _empty_contacts(64, group), _empty_contacts(64, group), 0
        self._room = _pair_storage(64)
        self._order = np.zeros(n, np.int64)
        self._since = np.full((3, n), np.inf)
        self._reference, self._flexibility, self._motion = np.zeros((3, n)), np.zeros((4, 4)), np.zeros((2, 3, 4))
        self._stride, self._strain = max(n // FIT_NODES, 1), 0.0
        self._moved = np.zeros(n, np.bool_)
        self._master = np.arange(n) if group.images is None else masters(group.images)[:n]
        self._along = np.full((n, MOST), -1)
        self.speed, self.recovering = 0.0, 0
        self.searches, self.seconds = 0, 0.0

    def settle(self) -> Overlaps:
        """Find the first contacts; returns what overlaps, which starts free of force.

        Raises :class:`InputError` listing the worst pairs when an overlap exceeds :data:`MAX_OVERLAP`.
        """
        self._moved[:] = True
        self.speed = search.largest_speed(self.nodes)
        self._find_contacts()
        c, n = self.contacts, self.count
        gap = np.linalg.norm(c.offset[:, :n], axis=0)
        touch = self.touch()
        share = (touch - gap) / self.group.radius[c.piece[:, :n]].min(axis=0)
        worst = np.argsort(-share, kind="stable")[:LISTED]
        if n and share[worst[0]] > MAX_OVERLAP:
            raise InputError(
                f"initial yarn overlap exceeds {100 * MAX_OVERLAP:g} % of the yarn radius; worst pairs: "
                + "; ".join(self._describe(int(k), float(share[k])) for k in worst if share[k] > MAX_OVERLAP)
            )
        c.accepted[:n] = np.maximum(touch - c.reach[:n], 0.0)
        count = int((share > OVERLAP_COUNTS).sum())
        listed = tuple(self._describe(int(k), float(share[k])) for k in worst if share[k] > OVERLAP_COUNTS)
        return Overlaps(count, max(float(share[worst[0]]), 0.0) if n else 0.0, listed)

    def touch(self) -> Array:
        """Sum of radii, or extents of ellipses [mm], of the contacts in use, (count,): their reach if not cut."""
        radii = self.group.radius[self.contacts.piece[:, : self.count]].sum(axis=0)
        extents = self.contacts.touch[: self.count]
        return np.where(extents > 0.0, extents, radii) if extents.size else radii

    def press(self, most: float) -> float:
        """Let up to ``most`` [mm] more of overlaps that are free of force carry it; returns the deepest left [mm]."""
        reach, touch = self.contacts.reach[: self.count], self.touch()
        np.minimum(reach + most, touch, out=reach)
        accepted = self.contacts.accepted[: self.count]
        np.minimum(accepted, touch - reach, out=accepted)
        gap = np.linalg.norm(self.contacts.offset[:, : self.count], axis=0)
        return float((touch - np.maximum(reach, gap)).max(initial=0.0))

    def recover(self, time: float) -> tuple[float, float]:
        """Give force to overlaps that came without one after the start, slowly, as ``time`` [ms] goes by.

        Returns the energy [mJ] that the penalty gains by it at a fixed gap, and the deepest of these overlaps over the
        smaller radius.

        A contact that was found late, or whose closest points jumped to a place where the yarns are nearer, starts at
        its present gap, so that it makes no energy. Its reach then grows back to the sum of radii less the overlap of
        the start, within some :data:`RECOVERY`, and pushes the yarns apart. That is slow beside a contact's period,
        so that little energy is given.
        """
        group = self.group
        given, self.recovering, deepest = search.recover_overlaps(
            self.contacts,
            self.count,
            group.radius,
            group.law,
            LEFT_FREE,
            min(time / RECOVERY, 1.0),
            self.portion(),
        )
        return float(given), float(deepest)

    def portion(self) -> float:
        """Largest overlap that is given force in one update, over the smaller radius."""
        group = self.group
        if not group.compliant:
            return PORTION if group.images is None else SMALL_PORTION
        if group.images is not None or not self.recovering:
            return SMALL_PORTION
        n = self.count
        depth = self.contacts.reach[:n] - np.linalg.norm(self.contacts.offset[:, :n], axis=0)
        depth /= group.radius[self.contacts.piece[:, :n]].min(axis=0)
        pressing = depth > 0.0
        mean = float(depth[pressing].mean()) if pressing.any() else 0.0
        return min(max(DEPTH_SHARE * mean, SMALL_PORTION), PORTION)

    def force_free(self) -> Array:
        """Overlap without force over the smaller radius of the contacts in use, (count,)."""
        n = self.count
        gap = np.linalg.norm(self.contacts.offset[:, :n], axis=0)
        hidden = self.touch() - np.maximum(self.contacts.reach[:n], gap)
        return np.maximum(hidden, 0.0) / self.group.radius[self.contacts.piece[:, :n]].min(axis=0)

    def end_flags(self) -> Flags:
        """Flags of the contacts in use, (count,), with a piece near the end of its yarn."""
        first, second = self.contacts.piece[:, : self.count]
        return self.group.cut[first] | self.group.cut[second]

    def _describe(self, contact: int, share: float) -> str:
        nodes = self.contacts.piece[:, contact]
        names = [self.name_of(int(i)) for i in nodes]
        x, y, z = self.nodes.position[:, nodes[0]]
        return f"{names[0]} and {names[1]} at ({x:.1f}, {y:.1f}, {z:.1f}) mm by {100 * share:.1f} %"

    def safe_steps(self, dt: float, most: int, speed: float = 0.0) -> int:
        """Steps, at most ``most``, in which no gap can close by more than the contact skin.

        Nodes move at the last speed seen, or at ``speed`` [mm/ms] if that is larger.
        Few while overlaps are given force.
        """
        if self.recovering:
            most = min(most, LEAST_STEPS)
        return int(np.clip(0.4 * CONTACT_SKIN / max(self.speed * dt, speed * dt, 1e-12), LEAST_STEPS, most))

    def update(self, ahead: float) -> tuple[float, float]:
        """Renew contacts whose skin could be used up within ``ahead`` [ms]; returns what :meth:`recover` does."""
        start = clock.perf_counter()
        is_specimen = self.group.images is None  # a cell is small, and its loops may snap: displacements stay absolute
        if is_specimen:
            search.fit_motion(self.nodes, self._reference, self._flexibility, self._stride, self._motion)
        if not np.isfinite(self._motion).all():  # of one node that is not finite: the others are still searched
            self._motion[:] = 0.0
        limit = ((1.0 - STRAIN_SHARE) if is_specimen else 1.0) * search.REACHED * CONTACT_SKIN
        count, farthest, self.speed = search.flag_deviating(
            self.nodes, self._reference, self._motion, self._since, ahead, limit, self._moved
        )  # fmt: skip
        if strained := self._closing_by_strain(ahead, farthest) > STRAIN_SHARE * CONTACT_SKIN:
            self._moved[:] = True
        if strained or count:
            self._find_contacts()
        given = self.recover(ahead) if self.count else (0.0, 0.0)
        self.seconds += clock.perf_counter() - start
        return given

    def state(self) -> State:
        """Contacts in use, where every piece was last looked at, and the speed that sets the next look."""
        counts = np.array([self.count, self.contacts.reach.size, self._spare.reach.size, self.searches])
        return arrays_of("contacts", _used_contacts(self.contacts, self.count), OF_CONTACTS) | {
            "since": self._since.copy(), "reference": self._reference.copy(), "along": self._along.copy(),
            "speed": np.array(self.speed), "counts": counts, "strain": np.array(self._strain),
            "recovering": np.array(self.recovering),
        } | ({name: getattr(self.group, name).copy() for name in SHAPES} if self.group.shape.size else {})  # fmt: skip

    def restore(self, state: State) -> None:
        """Put back what :meth:`state` gave; raises :class:`InputError` if it is another model's."""
        self.count, capacity, spare, self.searches = (int(v) for v in checked_array(state, "counts", (4,)))
        # the spare list holds nothing between two searches; its size only says when it must grow
        self.contacts, self._spare = _empty_contacts(capacity, self.group), _empty_contacts(spare, self.group)
        put_back(state, "contacts", _used_contacts(self.contacts, self.count), OF_CONTACTS)
        if self.group.shape.size:
            for name in SHAPES:
                array = getattr(self.group, name)
                array[:] = checked_array(state, name, array.shape)
        if self.group.excess.size:
            turn_sections(0, self.group.excess.size, self.nodes, self.contacts)
        self._since[:] = checked_array(state, "since", self._since.shape)
        self._reference[:] = checked_array(state, "reference", self._reference.shape)
        self._flexibility = search.motion_basis(self._reference[:, :: self._stride], SMOOTHING)
        self._along[:] = checked_array(state, "along", self._along.shape)
        self.speed, self._strain, self.recovering = (
            float(checked_array(state, "speed", ())),
            float(checked_array(state, "strain", ())),
            int(checked_array(state, "recovering", ())),
        )

    def _find_contacts(self) -> None:
        """Search around the moved pieces and renew the list; it grows when it overflows.

        Raises :class:`NumericalError` for a position that is not finite: it lies in no cell of the search.
        """
        group = self.group
        x, y, z = position = self.nodes.position[:, : group.radius.size]
        if not np.isfinite(position).all():
            i = int(np.argmin(np.isfinite(position).all(axis=0)))
            raise NumericalError(f"the position of node {i} of {self.name_of(i)} is not finite")
        # the pieces at the ends of yarns are half an element longer
        half = (2.0 if group.images is None else 1.0) * float(group.half_piece.max())
        cell = 2.0 * (float(group.bound.max()) + half) + CONTACT_SKIN
        low = position.min(axis=1)
        shape = ((position.max(axis=1) - low) / cell).astype(np.int64) + 1
        head = np.zeros(int(shape.prod()) + 1, np.int64)
        cell_of = search.fill_cells(x, y, z, group.is_piece, cell, low, shape, head, self._order)
        # a piece moves with the nodes beside its own; at the ends of yarns none is
        moved = self._moved | np.roll(self._moved, 1) | np.roll(self._moved, -1)
        if group.near is not None:  # far images are in no contact but with these, whichever of both moved
            self._moved[:], moved = True, group.near
        pieces = Pieces(
            group.bound, group.half_piece, group.exclude, group.chain, group.cut, self._master, self._along,
            group.images is None,
        )  # fmt: skip
        if group.excess.size:
            turn_sections(0, group.excess.size, self.nodes, self.contacts)
        pairs, moved = self._find_pairs(position, pieces, moved, Cells(cell_of, shape, head, self._order))
        if group.excess.size:
            place_ellipses(*pairs, position, self.contacts, self.alive, CONTACT_SKIN)
        if self._spare.reach.size < self.count:
            self._spare = _empty_contacts(self.contacts.reach.size, group)
        while True:
            needed = search.find_contacts(
                position, *pairs, group.radius, group.part, group.levers, pieces, self.alive, moved, CONTACT_SKIN,
                self.contacts, self.count, self._spare,
            )  # fmt: skip
            if needed <= self._spare.reach.size:
                break
            self._spare = _empty_contacts(needed + needed // 4, group)
        self.contacts, self._spare, self.count = self._spare, self.contacts, needed
        if group.owned is not None and group.images is not None:
            self.contacts.share[:needed] = group.owned[self.contacts.piece[:, :needed]].mean(axis=0)
            share_states(self.contacts, needed, group.images, self._master)
        search.assign_halves(self.contacts, self.count, group.node_cut)
        self._reset_displacements(position)
        self.searches += 1

    def _reset_displacements(self, position: Array) -> None:
        """Let displacements of the searched pieces begin at ``position``, and the motion if all were searched."""
        if self._moved.all():
            self._reference[:], self._since[:], self._motion[:], self._strain = position, 0.0, 0.0, 0.0
            self._flexibility = search.motion_basis(position[:, :: self._stride], SMOOTHING)
            return
        relative = position - self._reference - self._motion[0, :, 3:]
        for k in range(3):
            relative -= self._motion[0, :, k : k + 1] * self._reference[k]
        self._since[:, self._moved] = relative[:, self._moved]

    def _closing_by_strain(self, ahead: float, farthest: float) -> float:
        """Largest closing [mm] of a gap by the affine motion alone, up to ``ahead`` [ms] from now.

        ``farthest`` is the largest displacement of a node relative to that motion until then [mm].
        """
        now, rate = (float(np.linalg.norm(gradient)) for gradient in self._motion[:, :, :3])
        self._strain = max(self._strain, now + ahead * rate)
        return 4.0 * self._strain * (float(self.group.bound.max()) + farthest) / max(1.0 - self._strain, 1e-9)

    def _find_pairs(
        self, position: Array, pieces: Pieces, moved: Flags, cells: Cells
    ) -> tuple[tuple[Index, Array, Index], Flags]:
        """Pairs, found again until what lies along others is known; returns also what was looked at.

        Pieces that came to lie along others, or do no longer, are looked at as if they had moved.
        """
        before = self._along.copy()
        self._along[:] = -1
        mark_tracked(self.contacts, self.count, position, pieces)
        while True:
            changed = (self._along != before).any(axis=1)[self._master]
            moved = moved | (changed if self.group.near is None else changed & self.group.near)
            if self.group.near is None:
                flag_other_kinds(self.contacts, self.count, pieces, moved)
            before = self._along.copy()
            pairs = self._near_pairs(position, pieces, moved, cells)
            marked = mark_found(*pairs, position, self.group.excess, pieces)
            if self.group.excess.size:
                marked += mark_ellipses(*pairs, position, self.contacts, pieces)
            if not marked:
                return pairs, moved

    def _near_pairs(self, position: Array, pieces: Pieces, moved: Flags, cells: Cells) -> tuple[Index, Array, Index]:
        """Pairs, their places and how many there are, by share; room for them grows when it overflows."""
        found = np.zeros(PARTITIONS, np.int64)
        while True:
            find_pairs(position, pieces, self.alive, moved, cells, CONTACT_SKIN, *self._room, found)
            if (most := int(found.max())) <= self._room[0].shape[1]:
                return *self._room, found
            self._room = _pair_storage(most + most // 4)
