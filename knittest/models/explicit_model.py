"""A model ready for the explicit driver: state arrays, masses, contact group, parts and a viewer's mesh."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.history import Mesh
from knittest.kernels.options import PARTITIONS
from knittest.kernels.state import Beams, ContactLaw, Nodes, Partitions

Array = NDArray[np.float64]
Index = NDArray[np.int64]


@dataclass
class YarnContactGroup:
    """What the neighbour search needs: radius and half piece length [mm], exclusion along the yarn, pieces."""

    radius: Array
    half_piece: Array
    exclude: Index
    is_piece: NDArray[np.bool_]
    law: ContactLaw


@dataclass
class ExplicitModel:
    """Arrays of one model.

    ``mass`` [g], ``inertia`` [g mm^2], ``chain`` (n_nodes,) chain number of each node; ``critical_step`` [ms] before
    the safety factor; ``added_mass`` [-] share added by mass scaling; ``parts`` names the energy groups.
    """

    nodes: Nodes
    parts: Partitions
    beams: Beams
    mass: Array
    inertia: Array
    chain: Index
    part_names: tuple[str, ...]
    mesh: Mesh
    element_node: Index
    critical_step: float
    added_mass: float
    contact: YarnContactGroup | None

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return self.mass.size

    def yarn_name(self, node: int) -> str:
        """System and number of the yarn that owns ``node``, for messages."""
        yarn = int(self.chain[node])
        of_part = self.mesh.part[self.mesh.yarn == yarn]
        first = int(self.mesh.yarn[self.mesh.part == of_part[0]].min())
        return f"{self.part_names[int(of_part[0])]} {yarn - first + 1}"

    def position(self) -> Array:
        """Copy of the node positions [mm], (n_nodes, 3)."""
        return np.ascontiguousarray(self.nodes.position[:, : self.n_nodes].T)


def make_nodes(position: Array, mass: Array, inertia: Array) -> Nodes:
    """Node arrays at rest at ``position`` [mm], (n, 3), with lumped ``mass`` [g] and ``inertia`` [g mm^2]."""
    n = len(position)
    padded = np.vstack([position, position[-1:] + 1.0]).T.copy()
    rotation = np.zeros((4, n + 1))
    rotation[0] = 1.0
    inverse = [np.append(np.divide(1.0, a, out=np.zeros(n), where=a > 0.0), 0.0) for a in (mass, inertia)]
    return Nodes(padded, rotation, *(np.zeros((3, n + 1)) for _ in range(4)), *inverse)


def make_partitions(chain_start: Index, chain_section: Index) -> Partitions:
    """Cut the nodes at chain ends into :data:`PARTITIONS` nearly equal parts.

    ``chain_start`` (n_chains + 1,) first nodes; ``chain_section`` (n_chains,) beam section, -1 for none. Neighbouring
    chains of one section in one partition form a span.
    """
    n = int(chain_start[-1])
    targets = np.arange(PARTITIONS + 1) * n // PARTITIONS
    cut = np.searchsorted(chain_start, targets)
    cut[0], cut[-1] = 0, len(chain_start) - 1
    spans, span_start = [], [0]
    for p in range(PARTITIONS):
        for c in range(cut[p], cut[p + 1]):
            begin, end, section = int(chain_start[c]), int(chain_start[c + 1]), int(chain_section[c])
            if len(spans) > span_start[-1] and spans[-1][2] == section and spans[-1][1] == begin:
                spans[-1][1] = end
            else:
                spans.append([begin, end, section])
        span_start.append(len(spans))
    return Partitions(
        chain_start[cut].astype(np.int64), np.array(span_start, np.int64), np.array(spans, np.int64).reshape(-1, 3)
    )
