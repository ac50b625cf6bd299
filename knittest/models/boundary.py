"""Motions, loads and rigid tools that act on a model from outside, sorted for the kernel, and sums of their
reactions.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knittest.base.arrays import Array, Index
from knittest.base.errors import InputError
from knittest.kernels.state import ABOUT, ALONG, Drive, Loads, Motions, Tables, Tally, ToolContactState
from knittest.kernels.tool_contact import FREE, HELD, n_blocks
from knittest.kernels.vec import PARTITIONS
from knittest.models.explicit_model import ExplicitModel
from knittest.models.inputs import (
    check_independent,
    check_nodes_used,
    check_prescribed_once,
    finite_array,
    names_among,
    node_numbers,
    number_above,
    orthonormal,
)
from knittest.models.tool import Table, Tool, constant, put_table, tool_arrays


def group_loads(start: Index, node: Index, dof: Index, table: Index, guides: Index, value: Array) -> Loads:
    """Loads (n,), sorted by partition, dof, table and node, in runs of neighbouring nodes.

    ``start`` (PARTITIONS + 1,) first load of each partition. A table either loads or ``guides``.
    """
    begins = np.ones(len(node), np.bool_)
    begins[1:] = (np.diff(node) != 1) | (np.diff(dof) != 0) | (np.diff(table) != 0)
    begins[start[start < len(node)]] = True
    at = np.flatnonzero(begins)
    length = np.diff(np.append(at, len(node)))
    return Loads(np.searchsorted(at, start), node[at], length, at, dof[at], table[at], guides[at], value)


#: degrees of freedom by name
ALL = ("x", "y", "z", "rx", "ry", "rz")
DOFS = {name: number for number, name in enumerate(ALL)}
#: penalty of a node against tools over m / dt^2: 0.4 raises the highest frequency by a few percent at most
TOOL_STIFFNESS = 0.4
#: share of critical damping of a touching node
TOOL_DAMPING = 0.05


class Boundary:
    """Motions, loads and tools that act on ``model``; :meth:`drive` gives it to the kernel. Time step ``dt`` [ms] sets
    the tools' penalty.

    ``drive`` fixes it: whatever is added later raises :class:`InputError`, as nodes that do not exist and unknown
    degrees of freedom do.
    """

    def __init__(self, model: ExplicitModel, dt: float) -> None:
        self.model, self.dt = model, dt
        self.tables: list[Table] = [constant(0.0)]
        self._motions: list[tuple[Array, ...]] = []
        self._axes: list[Array] = [np.eye(3)]
        self._loads: list[tuple[Array, ...]] = []
        self.groups = 0
        self.tools: list[Tool] = []
        self.radius = np.zeros(model.n_nodes)
        self._driven = False

    def table(self, table: Table) -> int:
        """Number of a table, for :class:`Tool`."""
        self._check_not_started("a table")
        if not isinstance(table, Table):
            raise InputError(f"table: expected a Table, such as constant({table!r:.40}), got {type(table).__name__}")
        self.tables.append(table)
        return len(self.tables) - 1

    def move(
        self,
        nodes: ArrayLike,
        dofs: str | Sequence[str],
        table: Table | None = None,
        scale: ArrayLike = 1.0,
        axes: ArrayLike | None = None,
    ) -> int:
        """Prescribe velocities [mm/ms, rad/ms] of ``nodes``: ``scale`` (n,) times ``table`` (default: held).

        ``axes`` (3, 3): rows along which x, y, z of ``dofs`` lie, at right angles, and about which rx, ry, rz turn;
        they stand still. A symmetry plane across the first holds x, ry and rz, an inclined roller x. Returns the number
        under which the reactions are summed, each times its scale: conjugate to the table. A degree of freedom has one
        motion; it may be held twice, as at corners of symmetry planes, where the first hold counts the reaction.
        """
        node, names = self._nodes_and_dofs("a motion", nodes, dofs)
        share = _one_per_node(scale, "scale of a motion", node)
        number, frame = 0 if table is None else self.table(table), 0
        if axes is not None:
            self._axes.append(orthonormal(axes))
            frame = len(self._axes) - 1
        for dof in names:
            kind = DOFS[dof] if axes is None else (ALONG if DOFS[dof] < 3 else ABOUT)
            _add_rows(self._motions, node, kind, number, share, self.groups, 3 * frame + DOFS[dof] % 3)
        self.groups += 1
        return self.groups - 1

    @property
    def largest_speed(self) -> float:
        """Largest speed [mm/ms] that a prescribed motion along an axis gives to a node."""
        largest = np.array([np.abs(table.value).max() for table in self.tables])
        speeds = [
            np.abs(scale * largest[table.astype(int)])[(kind < 3) | (kind == ALONG)]
            for _, kind, table, scale, _, _ in self._motions
        ]
        return float(np.concatenate([[0.0], *speeds]).max())

    def grip(self, nodes: ArrayLike, dof: str, table: Table | None = None) -> int:
        """Clamp all degrees of freedom of ``nodes`` in a massless jaw that moves along ``dof``, as :meth:`move` does.

        Cheaper than moving six degrees of freedom; only the reactions along ``dof`` are summed.
        """
        group = self.move(nodes, dof, table)
        for array in (self.model.nodes.inv_mass, self.model.nodes.inv_inertia, self.model.mass, self.model.inertia):
            array[np.asarray(nodes)] = 0.0
        return group

    def load(self, nodes: ArrayLike, dof: str, value: ArrayLike, table: Table | None = None) -> None:
        """Force [N] or moment [N mm] ``value`` (n,) times ``table`` (default: constant 1) on ``nodes``.

        Loads on one node add up.
        """
        node, names = self._nodes_and_dofs("a load", nodes, dof)
        if len(names) != 1:
            raise InputError(f"load: expected one degree of freedom, got {len(names)}; call load once for each")
        size = _one_per_node(value, "value of a load", node)
        check_nodes_used(node[np.broadcast_to(size, node.shape) != 0.0], self.model.mesh.cells)
        _add_rows(self._loads, node, DOFS[names[0]], self.table(table or constant(1.0)), 0, size)

    def guide(self, nodes: ArrayLike, dof: str, velocity: Table, scale: ArrayLike = 1.0) -> None:
        """Guide ``nodes`` along ``dof`` (x, y or z) by the velocity u, ``scale`` (n,) times the table ``velocity``
        [mm/ms]: a force m du/dt accelerates them with it, and mass-proportional damping acts on their velocity
        relative to it.

        Without a guide the motion of a rig reaches the specimen as a wave, and damping drags on it. The guide does no
        work on a specimen that moves with a constant u.
        """
        self._check_not_started("a guide")
        node = node_numbers(nodes, self.model.n_nodes)
        names = names_among(dof, ALL[:3], "axis")
        momentum = self.model.mass[node] * _one_per_node(scale, "scale of a guide", node)
        _add_rows(self._loads, node, DOFS[names[0]], self.table(velocity), 1, momentum)

    def _nodes_and_dofs(self, what: str, nodes: ArrayLike, dofs: str | Sequence[str]) -> tuple[Index, list[str]]:
        """Checked nodes and degrees of freedom, at least one of each: a selection may have found none."""
        self._check_not_started(what)
        node = node_numbers(nodes, self.model.n_nodes)
        names = names_among(dofs, ALL, "degree of freedom")
        if not node.size or not names:
            missing = "degrees of freedom" if node.size else "nodes"
            raise InputError(f"{missing}: expected at least one, got none")
        return node, names

    def unfinished_motions(self) -> list[str]:
        """Motions, as move numbered them, and tools whose tables do not end at rest."""
        last = np.array([table.value[-1] for table in self.tables])
        groups = {int(g) for _, _, t, s, group, _ in self._motions for g in group[(s * last[t.astype(int)]) != 0.0]}
        moved = [n for n, tool in enumerate(self.tools) if any(m >= 0 and last[m] != 0.0 for m in tool.motion)]
        return [f"motion {number}" for number in sorted(groups)] + [f"tool {number}" for number in moved]

    def _check_not_started(self, what: str) -> None:
        if self._driven:
            raise InputError(f"{what} was added after the start and would have no effect; add it before the first step")

    def gravity(self, weight: Array, direction: ArrayLike = (0.0, 0.0, -1.0), table: Table | None = None) -> None:
        """Weight [N] of each node, (n_nodes,), along ``direction``."""
        for dof, share in zip("xyz", finite_array(direction, "direction of gravity", (3,)), strict=True):
            if share != 0.0:
                self.load(np.arange(self.model.n_nodes), dof, share * weight, table)

    def add_tool(self, tool: Tool) -> int:
        """Add a rigid tool; returns its number."""
        self._check_not_started("a tool")
        if self.model.flattens:
            raise InputError(
                "tool: rigid tools do not flatten yarn sections; remove fabric.reinforcing.section.flattening, or use "
                "a test without tools"
            )
        if any(tool is one for one in self.tools) or tool.moved_in not in (None, self):
            raise InputError("tool: it already belongs to a body; make a new tool for each body")
        self.tools.append(tool)
        return len(self.tools) - 1

    def move_tool(self, number: int, axes: str | Sequence[str], velocity: Table) -> None:
        """Move tool ``number`` along ``axes`` (x, y, z) with ``velocity`` [mm/ms]; it is held along the others."""
        self._move_along(self._tool(number), names_among(axes, ALL[:3], "axis"), number, self.table(velocity))

    def free_tool(
        self, number: int, axes: str | Sequence[str], mass: float, force: Table | None = None, drag: float = 0.0
    ) -> None:
        """Let tool ``number`` of ``mass`` [g] move along ``axes`` (x, y, z) under what it touches, ``force`` [N] along
        each and a ``drag`` [1/ms] in proportion to its momentum.
        """
        number_above(mass, "mass of a free tool [g]")
        number_above(drag, "drag of a free tool [1/ms]", equal=True)
        tool, names = self._tool(number), names_among(axes, ALL[:3], "axis")
        if FREE in tool.motion and (tool.mass, tool.drag) != (mass, drag):
            raise InputError(f"tool {number} is already free with another mass or drag; give a tool one of each")
        load = -1 if force is None else self.table(force)
        self._move_along(tool, names, number, FREE)
        tool.mass, tool.drag = mass, drag
        for axis in names:
            tool.load[DOFS[axis]] = load

    def _move_along(self, tool: Tool, axes: list[str], number: int, motion: int) -> None:
        """Give ``tool`` its ``motion`` along ``axes``, each of which may have one."""
        self._check_not_started("a motion of a tool")
        for axis in axes:
            if tool.motion[DOFS[axis]] != HELD:
                raise InputError(f"tool {number} is already moved or free along {axis}; give each axis one motion")
            tool.motion[DOFS[axis]] = motion
        tool.moved_in = self

    def _tool(self, number: int) -> Tool:
        if not 0 <= number < len(self.tools):
            raise InputError(f"tool {number}: expected a number returned by add_tool, below {len(self.tools)}")
        return self.tools[number]

    def drive(self) -> Drive:
        """Tables, motions, loads and tools as the kernel takes them."""
        self._driven = True
        knots = np.zeros(len(self.tables), np.int64)
        time, value = np.zeros((2, len(self.tables), max(len(t.time) + t.room for t in self.tables)))
        motions = self._motion_arrays()
        loads = group_loads(
            *self._sort_by_partition(self._loads, (np.int64, np.int64, np.int64, np.int64, np.float64), runs=True)
        )
        tables = Tables(knots, time, value, np.zeros((2, len(self.tables))))
        for number, table in enumerate(self.tables):
            put_table(tables, number, table)
        return Drive(tables, motions, loads, tool_arrays(self.tools), self._contact_state())

    def _motion_arrays(self) -> Motions:
        """Motions as the kernel takes them; raises :class:`InputError` for axes that one node cannot have together."""
        kinds = (np.int64, np.int64, np.int64, np.float64, np.int64, np.int64)
        start, node, dof, table, scale, group, row = self._sort_by_partition(self._motions, kinds)
        axis = np.concatenate(self._axes)[row]
        still = (scale == 0.0) | np.array([not any(one.value) for one in self.tables])[table]
        fixed = dof < ALONG
        check_prescribed_once(node[fixed], dof[fixed], still[fixed], group[fixed], ALL)
        check_independent(node, np.isin(dof, (3, 4, 5, ABOUT)), axis, dof >= ALONG)
        return Motions(start, node, dof, table, scale, group, axis)

    def _sort_by_partition(
        self, groups: list[tuple[Array, ...]], kinds: tuple[type, ...], runs: bool = False
    ) -> list[NDArray]:
        """Starts of the partitions, then columns (node, dof, table, ...) sorted by partition, node, dof or, for
        ``runs``, by partition, dof, table, node.
        """
        columns: list[NDArray] = [
            np.concatenate([g[k] for g in groups] or [np.zeros(0)]).astype(kind) for k, kind in enumerate(kinds)
        ]
        owner = np.searchsorted(self.model.parts.node, columns[0], side="right") - 1
        keys = (columns[0], columns[2], columns[1]) if runs else (columns[1], columns[0])
        order = np.lexsort((*keys, owner))
        start = np.searchsorted(owner[order], np.arange(PARTITIONS + 1))
        return [start, *(np.ascontiguousarray(c[order]) for c in columns)]

    def _contact_state(self) -> ToolContactState:
        n, n_tools = self.model.n_nodes, len(self.tools)
        mass = np.where(self.model.mass > 0.0, self.model.mass, 0.0)
        stiffness = TOOL_STIFFNESS * mass / self.dt**2
        viscous = 2.0 * TOOL_DAMPING * np.sqrt(stiffness * mass)
        blocks = (n_tools, n_blocks(n))
        return ToolContactState(
            self.radius, stiffness, viscous, np.zeros((n_tools, 3, n)), np.zeros((n_tools, n)), np.zeros((n_tools, n)),
            np.zeros(blocks), np.zeros((n_tools, n), np.int32), np.zeros(blocks, np.int64),
        )  # fmt: skip


def _add_rows(groups: list[tuple[Array, ...]], *columns: ArrayLike) -> None:
    groups.append(tuple(np.array(c) for c in np.broadcast_arrays(*columns)))


def _one_per_node(values: ArrayLike, name: str, node: Index) -> Array:
    """Finite ``values``, one for all or one a node."""
    array = finite_array(values, name)
    if array.shape not in ((), (1,), node.shape):
        raise InputError(f"{name}: {array.shape} numbers for {len(node)} nodes; expected one number, or one per node")
    return array


def new_tally(boundary: Boundary) -> Tally:
    """Empty accumulators for ``boundary``."""
    n_tools, groups = len(boundary.tools), (PARTITIONS, max(boundary.groups, 1))
    return Tally(
        np.zeros(groups), np.zeros((PARTITIONS, 9)), np.zeros((PARTITIONS, n_tools, 3)), np.zeros((n_tools, 3)),
        np.zeros(groups), np.zeros(1),
    )  # fmt: skip


@dataclass(frozen=True)
class Readings:
    """Means over a few steps: ``reaction`` (n_groups,) [N or N mm], conjugate to the tables, ``tool_force`` on each
    tool [N], (n_tools, 3), and the tools' ``tool_position`` [mm], (n_tools, 3), at their end.
    """

    reaction: Array
    tool_force: Array
    tool_position: Array

    @classmethod
    def of(cls, row: Array, n_tools: int) -> "Readings":
        """Readings from the flat form that :func:`take_readings` gives."""
        tools = row[len(row) - 6 * n_tools :].reshape(2, n_tools, 3)
        return cls(row[: len(row) - 6 * n_tools], tools[0], tools[1])


def take_readings(tally: Tally, drive: Drive, steps: int) -> Array:
    """Flat means over ``steps`` of what ``tally`` has summed, which is reset."""
    row = np.concatenate(
        [tally.reaction.sum(axis=0) / steps, tally.tool_sum.ravel() / steps, drive.tools.position.ravel()]
    )
    tally.reaction[:], tally.tool_sum[:], tally.support[:] = 0.0, 0.0, 0.0
    return row
