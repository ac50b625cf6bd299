"""A model ready for the explicit driver: node arrays, masses, parts, a viewer's mesh, and its state as a flat
dictionary.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from knittest.base.arrays import Array, Index
from knittest.base.errors import InputError
from knittest.base.history import Mesh, Overlaps
from knittest.kernels.state import Drive, Nodes, Partitions, Tally
from knittest.kernels.vec import PARTITIONS

State = dict[str, np.ndarray]


def arrays_of(prefix: str, holder: object, names: Iterable[str]) -> State:
    """Copies of the arrays ``names`` of ``holder``, keyed ``prefix/name``."""
    return {f"{prefix}/{name}": np.array(getattr(holder, name)) for name in names}


def put_back(state: Mapping[str, np.ndarray], prefix: str, holder: object, names: Iterable[str]) -> None:
    """Copy what :func:`arrays_of` took into the arrays of ``holder``, which kernels may hold: never replace them."""
    for name in names:
        target = getattr(holder, name)
        target[...] = checked_array(state, f"{prefix}/{name}", target.shape)


def checked_array(state: Mapping[str, np.ndarray], key: str, shape: tuple[int, ...] | None = None) -> np.ndarray:
    """Array ``key``; raises :class:`InputError` when it is not there or not of ``shape``."""
    if key not in state:
        raise InputError(f"the checkpoint has no {key}: it belongs to another model")
    value = state[key]
    if shape is not None and value.shape != shape:
        raise InputError(f"the checkpoint's {key} has shape {value.shape}, the model's {shape}: another model")
    return value


def without_prefix(state: Mapping[str, np.ndarray], prefix: str) -> State:
    """Entries ``prefix/...`` without the prefix."""
    return {k.removeprefix(prefix + "/"): v for k, v in state.items() if k.startswith(prefix + "/")}


def with_prefix(prefix: str, state: Mapping[str, np.ndarray]) -> State:
    """Entries with ``prefix/`` put before their keys."""
    return {f"{prefix}/{k}": v for k, v in state.items()}


def columns(rows: list[dict[str, float]]) -> State:
    """Rows with equal keys as one array (n_rows,) a key."""
    return {k: np.array([row[k] for row in rows]) for k in rows[0]} if rows else {}


def rows_of(state: Mapping[str, np.ndarray]) -> list[dict[str, float]]:
    """Rows that :func:`columns` was made of."""
    lists = {k: v.tolist() for k, v in state.items()}
    return [dict(zip(lists, values, strict=True)) for values in zip(*lists.values(), strict=True)]


#: arrays of the model itself that clamping changes
LUMPED = ("mass", "inertia")


@dataclass(frozen=True)
class StoredEnergies:
    """Elastic energies [mJ] by part, of contact and of hourglass control; ``penetration`` over radius of each contact
    that touches, (n_touching,).

    ``mechanisms`` are the same elastic energies of the parts by mechanism, (n_parts,) each.
    ``tools`` is the elastic energy of contacts with tools, ``tool_kinetic`` the kinetic energy of free tools,
    ``tool_depth`` the deepest penetration into one [mm]; ``force_free`` the deepest overlap of yarns that carries no
    force, over the smaller radius, away from their ends and at them.
    """

    internal: Array
    contact: float = 0.0
    hourglass: float = 0.0
    penetration: Array = field(default_factory=lambda: np.zeros(0))
    mechanisms: dict[str, Array] = field(default_factory=dict)
    tools: float = 0.0
    tool_kinetic: float = 0.0
    tool_depth: float = 0.0
    force_free: tuple[float, float] = (0.0, 0.0)


@dataclass
class ExplicitModel(ABC):
    """Interface of a model for the simulation.

    ``mass`` [g], ``inertia`` [g mm^2] (n_nodes,), 0 where clamped; ``critical_step`` [ms] before the safety factor;
    ``added_mass`` [-] share added by mass scaling; ``wave_speed`` [mm/ms] of the pulled yarn;
    ``mesh.part_names`` are the groups of energies and failures.
    """

    nodes: Nodes
    parts: Partitions
    mass: Array
    inertia: Array
    mesh: Mesh
    critical_step: float
    added_mass: float
    wave_speed: float

    #: whether the model starts with stresses that must relax first
    prestressed = False
    #: whether yarns that overlap at the start shall press each other by all of it
    pressed = False
    #: whether yarns store little energy and take long to come to rest
    compliant = False
    #: whether sections flatten, which tools do not press
    flattens = False
    #: steps between looks at displacement, kinetic energy and damping loss, at most
    chunk = 20

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return self.mass.size

    def position(self) -> Array:
        """Copy of the node positions [mm], (n_nodes, 3)."""
        return np.ascontiguousarray(self.nodes.position[:, : self.n_nodes].T)

    def halt(self) -> None:
        """Take all speed from the model."""
        self.nodes.velocity[:], self.nodes.spin[:] = 0.0, 0.0

    @abstractmethod
    def prepare(self) -> Overlaps:
        """Find what touches at the start; returns what overlaps. Raises InputError if it does too much."""

    @abstractmethod
    def safe_steps(self, dt: float, most: int, speed: float = 0.0) -> int:
        """Steps, at most ``most``, after which contacts must be searched again.

        ``speed`` [mm/ms] is one that nodes may take at once, where their present speed does not show it.
        """

    @abstractmethod
    def advance(self, steps: int, time: float, dt: float, drive: Drive, tally: Tally, scratch: Array) -> None:
        """Renew contacts that may come near, then :meth:`step`."""

    def kernel_drive(self, drive: Drive) -> tuple[Any, ...]:
        """Fields of ``drive`` as the kernels take them: where there are no tools, they are compiled for None."""
        some = drive.tools.kind.size > 0
        return (*drive[:3], *((drive.tools, drive.touch) if some else (None, None)))

    @abstractmethod
    def step(self, steps: int, time: float, dt: float, drive: Drive, tally: Tally, scratch: Array) -> None:
        """Advance ``steps`` steps with the contacts there are; see :mod:`knittest.kernels.explicit`."""

    @abstractmethod
    def stored_energies(self) -> StoredEnergies:
        """Elastic energies and penetration now."""

    @abstractmethod
    def count_failed(self) -> Index:
        """Failed elements by part, (n_parts,)."""

    @abstractmethod
    def fields(self, position: Array | None = None, time: float = np.inf) -> dict[str, Array]:
        """Element fields of a frame, as in :class:`knittest.base.history.Frame`.

        Those of the present state; or, given the nodes' ``position`` [mm], (3, n) as the model keeps it, those at an
        earlier ``time`` [ms].
        """

    @abstractmethod
    def resultants(self) -> dict[str, Array]:
        """:meth:`fields` with the moments, by element."""

    def contact_forces(self) -> tuple[Array, Array, Index]:
        """Places [mm] and forces [N] of the yarn contacts that touch, (n, 3) each, the force on the first of their two
        chains (n, 2).
        """
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2), np.int64)

    def press(self, most: float) -> float:
        """Let up to ``most`` [mm] more of overlaps that are to press do so; returns the deepest left [mm]."""
        return 0.0

    @abstractmethod
    def name_of(self, node: int) -> str:
        """Name of the part that ``node`` belongs to, for messages."""

    def diagnose(self, dt: float) -> str:
        """Diagnose the present state at time step ``dt`` [ms]: what makes it unusable, naming the entity; empty if
        nothing.
        """
        return self.invalid_state(dt)

    def stable_step(self) -> tuple[float, str]:
        """Longest stable time step [ms] of the present state, as far as it can fall below that of the start, and what
        limits it, for messages; infinite where nothing does.
        """
        return np.inf, ""

    def invalid_state(self, dt: float) -> str:
        """Describe what makes the present state at time step ``dt`` [ms] one that no result can be read from; empty
        if nothing does. The text after a semicolon is the remedy.
        """
        return ""

    def state(self) -> State:
        """State that a run changes, complete; with it in a freshly built model, a run goes on with the same bits.

        A model with more that changes adds its entries here and in :meth:`restore`.
        """
        return arrays_of("nodes", self.nodes, Nodes._fields) | arrays_of("model", self, LUMPED)

    def restore(self, state: State) -> None:
        """Put back what :meth:`state` gave; raises :class:`InputError` if it is another model's."""
        put_back(state, "nodes", self.nodes, Nodes._fields)
        put_back(state, "model", self, LUMPED)

    def contact_force_sum(self) -> float:
        """Sum of the forces between parts of the model [N]."""
        return 0.0

    def lattice_force(self) -> float:
        """Force [N] on numbers of a lattice that are free to move; 0 for a model without one."""
        return 0.0

    def largest_force(self) -> float:
        """Largest force [N] in an element or a contact of the model."""
        return 0.0

    def search_seconds(self) -> float:
        """Time spent so far in the search for contacts [s]."""
        return 0.0

    def broken_nodes(self, since: float) -> Index:
        """Nodes of yarns that broke after ``since`` [ms]; none for shells."""
        return np.zeros(0, np.int64)


def make_nodes(position: Array, mass: Array, inertia: Array) -> Nodes:
    """Node arrays at rest at ``position`` [mm], (n, 3), with lumped ``mass`` [g] and ``inertia`` [g mm^2]."""
    n = len(position)
    padded = np.vstack([position, position[-1:] + 1.0]).T.copy()
    rotation = np.zeros((4, n + 1))
    rotation[0] = 1.0
    inv_mass, inv_inertia = (np.append(np.divide(1.0, a, out=np.zeros(n), where=a > 0.0), 0.0) for a in (mass, inertia))
    velocity, spin, force, moment = (np.zeros((3, n + 1)) for _ in range(4))
    return Nodes(padded, rotation, velocity, spin, force, moment, inv_mass, inv_inertia, np.ones(n + 1))


def make_partitions(chain_start: Index, chain_section: Index) -> Partitions:
    """Cut the nodes at chain ends into :data:`PARTITIONS` nearly equal parts.

    ``chain_start`` (n_chains + 1,) first nodes; ``chain_section`` (n_chains,) beam section, -1 for none. Neighbouring
    chains of one section in one partition form a span.
    """
    n = int(chain_start[-1])
    targets = np.arange(PARTITIONS + 1) * n // PARTITIONS
    cut = np.searchsorted(chain_start, targets)
    cut[0], cut[-1] = 0, len(chain_start) - 1
    spans: list[list[int]] = []
    span_start = [0]
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
