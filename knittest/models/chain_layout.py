"""Yarns as chains of beams, and their arrays over the nodes of all of them."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from knittest.materials.yarn_section import Section
from knittest.models.inputs import across_chain

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Flags = NDArray[np.bool_]


@dataclass(frozen=True)
class Chain:
    """One yarn as a chain of beams.

    ``points`` (n, 3) [mm] are its shape at the start and the control points of its centre-line; ``part`` numbers the
    part of the model. ``fail_strain`` and ``slack`` [-] of its elements are (n - 1,) or one for all. ``stretch`` [-] is
    the true length over that of the polygon, for its mass. ``degree_of_set`` [-], (n - 1,) or one for all, is the share
    of the curvature that is free of moment; the rest was bent in. ``normal`` of a flat section, (3,) for all elements
    or (n - 1, 3), is the direction at the start about which it bends with ``Section.across``, and along which an
    elliptic one is as high as ``Section.radius`` says; its component along the chain is ignored. ``draw_in`` [-],
    (n - 1,) or one for all, is the share by which the yarn is shorter at rest than its ``points``: it starts under
    tension.
    """

    points: Array
    section: Section
    part: int = 0
    fail_strain: Array | float = np.inf
    slack: Array | float = 0.0
    stretch: float = 1.0
    degree_of_set: Array | float = 1.0
    normal: Array | None = None
    draw_in: Array | float = 0.0


@dataclass
class Layout:
    """Arrays over the nodes of all chains, (n_nodes,): chain, section, length of the element behind (1 at ends).

    ``cards`` are the sections, ``number`` (n_chains,) that of each chain; ``rest`` are the lengths without tension.
    """

    chains: Sequence[Chain]
    cards: list[Section]
    number: Index
    start: Index = field(init=False)
    chain: Index = field(init=False)
    section: Index = field(init=False)
    position: Array = field(init=False)
    chord: Array = field(init=False)
    joined: Flags = field(init=False)
    length: Array = field(init=False)
    rest: Array = field(init=False)

    def __post_init__(self) -> None:
        count = np.array([len(c.points) for c in self.chains])
        self.start = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
        self.chain = np.repeat(np.arange(len(self.chains)), count).astype(np.int64)
        self.section = self.number[self.chain]
        self.position = np.concatenate([np.asarray(c.points, float) for c in self.chains])
        self.chord = np.diff(self.position, axis=0, append=self.position[-1:] + 1.0)
        self.joined = np.append(self.chain[1:] == self.chain[:-1], False)
        self.length = np.where(self.joined, np.linalg.norm(self.chord, axis=1), 1.0)
        self.rest = self.length * (1.0 - np.where(self.joined, self.of_elements("draw_in"), 0.0))

    def inner(self) -> Flags:
        """Nodes that are not the end of a chain."""
        inner = np.full(len(self.chain), True)
        inner[self.start[:-1]] = inner[self.start[1:] - 1] = False
        return inner

    def near_ends(self, count: int) -> Flags:
        """Tell which pieces are among the ``count`` first or last of their chain."""
        place, stop = np.arange(len(self.chain)), self.start[1:][self.chain] - 1
        return (place - self.start[:-1][self.chain] <= count) | (stop - place <= count) if count else place < 0

    def of_card(self, name: str) -> Array:
        """A constant of each node's section."""
        return np.array([getattr(c, name) for c in self.cards])[self.section]

    def of_elements(self, name: str) -> Array:
        """A field of the chains that may be one number or one an element, on all nodes."""
        return np.concatenate(
            [
                np.append(np.broadcast_to(np.asarray(getattr(c, name), float), len(c.points) - 1), np.inf)
                for c in self.chains
            ]
        )

    def normals(self) -> Array:
        """Normals of the chains' elements (n, 3), not yet across them; nan where a round section has none."""
        rows = []
        for number, chain in enumerate(self.chains):
            rows.append(np.full((len(chain.points), 3), np.nan))
            if chain.section.across is not None or chain.section.half_width is not None:
                rows[-1][:-1] = across_chain(chain.points, chain.normal, number)
        return np.concatenate(rows)

    def mean_length(self, card: int) -> float:
        """Mean element length of a section [mm]."""
        of = (self.section == card) & self.joined
        return float(self.length[of].mean()) if of.any() else 1.0
