"""Keeps the list of yarn contacts current: candidate pairs with a wide skin, tracked contacts with a narrow one."""

import numpy as np

from knittest.kernels import monitor, search
from knittest.kernels.options import PARTITIONS
from knittest.kernels.state import Contacts
from knittest.models.explicit_model import ExplicitModel

#: gap up to which candidate pairs are listed and contacts are tracked [mm]
PAIR_SKIN = 0.25
CONTACT_SKIN = 0.06


def _empty(capacity: int) -> Contacts:
    pair, triple = (np.zeros((2, capacity)), [np.zeros((3, capacity)) for _ in range(3)])
    return Contacts(
        np.zeros((2, capacity), np.int64), pair, triple[0], triple[1], np.zeros(capacity), np.zeros(capacity), triple[2],
        np.zeros(2 * capacity, np.int64), np.zeros(PARTITIONS + 1, np.int64),
    )  # fmt: skip


class ContactTracker:
    """Contacts of one model, renewed by displacement; lists grow when they overflow, nothing is dropped."""

    def __init__(self, model: ExplicitModel) -> None:
        self.model = model
        self.contacts = _empty(64)
        self.count = 0
        self._spare = _empty(64)
        n = model.n_nodes
        self._pair_start = np.zeros(n + 1, np.int64)
        self._partner = np.zeros(8 * n, np.int64)
        self._order = np.zeros(n, np.int64)
        self._since_pairs = np.full((3, n), np.inf)
        self._since_contacts = np.full((3, n), np.inf)
        self.pair_builds = self.contact_builds = 0

    def update(self, ahead: float) -> tuple[float, float]:
        """Renew lists whose skin could be used up within ``ahead`` [ms]; returns (displacement, speed) seen."""
        if self.model.contact is None:
            return 0.0, monitor.reach(self.model.nodes, self._since_contacts)[1]
        moved, speed = monitor.reach(self.model.nodes, self._since_contacts)
        if not 2.0 * (moved + speed * ahead) < CONTACT_SKIN:
            far, _ = monitor.reach(self.model.nodes, self._since_pairs)
            if not 2.0 * far + CONTACT_SKIN < PAIR_SKIN:
                self._list_pairs()
            self._find_contacts()
        return moved, speed

    def _list_pairs(self) -> None:
        group, chain = self.model.contact, self.model.chain
        assert group is not None
        x, y, z = position = self.model.nodes.position[:, : self.model.n_nodes].copy()
        cell = 2.0 * (float(group.radius.max()) + float(group.half_piece.max())) + PAIR_SKIN
        low = position.min(axis=1)
        shape = ((position.max(axis=1) - low) / cell).astype(np.int64) + 1
        head = np.zeros(int(shape.prod()) + 1, np.int64)
        cell_of = search.fill_cells(x, y, z, group.is_piece, cell, low, shape, head, self._order)
        while True:
            needed = search.candidate_pairs(
                x, y, z, group.radius, group.half_piece, chain, group.exclude, cell_of, shape, head, self._order,
                PAIR_SKIN, self._pair_start, self._partner,
            )  # fmt: skip
            if needed <= self._partner.size:
                break
            self._partner = np.zeros(needed + needed // 4, np.int64)
        self._since_pairs = position
        self.pair_builds += 1

    def _find_contacts(self) -> None:
        group, chain = self.model.contact, self.model.chain
        assert group is not None
        x, y, z = position = self.model.nodes.position[:, : self.model.n_nodes].copy()
        while True:
            needed = search.find_contacts(
                x, y, z, group.radius, chain, self._pair_start, self._partner, CONTACT_SKIN,
                self.contacts, self.count, self._spare,
            )  # fmt: skip
            if needed <= self._spare.reach.size:
                break
            self._spare = _empty(needed + needed // 4)
        self.contacts, self._spare, self.count = self._spare, self.contacts, needed
        search.assign_halves(self.contacts, self.count, self.model.parts.node)
        self._since_contacts = position
        self.contact_builds += 1
