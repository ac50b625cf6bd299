"""Collects what acts on a model from outside - motions, loads, rigid tools - and sorts it for the kernel."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knittest.base.errors import InputError
from knittest.kernels.drive_state import (
    CYLINDER,
    GRID,
    PLANE,
    PLATE,
    SWEPT,
    Drive,
    Motions,
    Tables,
    Tools,
    Touch,
)
from knittest.kernels.options import PARTITIONS
from knittest.kernels.state import Tally
from knittest.kernels.tool_contact import FREE, HELD
from knittest.kernels.tool_shapes import FAR
from knittest.models.explicit_model import ExplicitModel
from knittest.models.inputs import finite, names_among, node_numbers
from knittest.models.load_runs import in_runs

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: degrees of freedom by name
DOFS = {"x": 0, "y": 1, "z": 2, "rx": 3, "ry": 4, "rz": 5}
ALL = ("x", "y", "z", "rx", "ry", "rz")
#: penalty of a node against tools over m / dt^2: 0.4 raises the highest frequency by a few percent at most
TOOL_STIFFNESS = 0.4
#: share of critical damping of a touching node
TOOL_DAMPING = 0.05


@dataclass(frozen=True)
class Table:
    """Piecewise linear function of time: ``time`` [ms] and ``value``, (n_knots,); constant outside."""

    time: tuple[float, ...]
    value: tuple[float, ...]

    def __post_init__(self) -> None:
        time, value = finite(self.time, "time of a table", (-1,)), finite(self.value, "value of a table", (-1,))
        if len(time) != len(value) or not len(time):
            raise InputError(f"a table has {len(time)} times and {len(value)} values; expected one value a time")
        if (np.diff(time) < 0.0).any():
            raise InputError(f"times of a table must not fall, got {self.time}")

    def integral(self, time: float) -> float:
        """Integral from 0 to ``time`` [ms]: the travel of a velocity table."""
        inside = [t for t in self.time if 0.0 < t < time]
        knots = np.array([0.0, *inside, time])
        return float(np.trapezoid(np.interp(knots, self.time, self.value), knots))


def constant(value: float) -> Table:
    """A function that does not change."""
    return Table((0.0,), (value,))


def ramp(duration: float, value: float, knots: int = 64) -> Table:
    """From 0 to ``value`` over ``duration`` [ms] by the quintic 10 u^3 - 15 u^4 + 6 u^5, then constant."""
    u = np.linspace(0.0, 1.0, knots + 1)
    smooth = u**3 * (10.0 - u * (15.0 - 6.0 * u))
    return Table(tuple(max(duration, 1e-9) * u), tuple(value * smooth))


@dataclass
class Tool:
    """A rigid body as :class:`Tools` holds it; made by the functions below."""

    kind: int
    position: Array
    axes: Array
    size: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    friction: tuple[float, float] = (0.0, 0.0)
    stiffness: float = 1.0
    motion: list[int] = field(default_factory=lambda: [HELD, HELD, HELD])
    load: list[int] = field(default_factory=lambda: [-1, -1, -1])
    mass: float = 1.0
    drag: float = 0.0
    samples: Array = field(default_factory=lambda: np.zeros((0, 0, 0)))
    plan: tuple[float, float, float, float, float] = (0.0, 0.0, FAR, FAR, 0.0)


def axes_along(direction: ArrayLike) -> Array:
    """Orthonormal axes as rows, the third along ``direction`` (3,)."""
    third = np.asarray(direction, float) / np.linalg.norm(direction)
    first = np.eye(3)[np.argmin(np.abs(third))]
    first = first - (first @ third) * third
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(third, first), third])


def plane(point: ArrayLike, normal: ArrayLike) -> Tool:
    """Half space below the plane through ``point`` [mm] with outward ``normal``."""
    return Tool(PLANE, np.array(point, float), axes_along(normal))


def plate(centre: ArrayLike, lengths: ArrayLike, edge_radius: float, axes: ArrayLike | None = None) -> Tool:
    """Box of side ``lengths`` (3,) about ``centre`` with rounded edges [mm]."""
    half = 0.5 * np.asarray(lengths, float)
    return Tool(
        PLATE, np.array(centre, float), np.eye(3) if axes is None else np.array(axes, float), (*half, edge_radius)
    )


def cylinder(centre: ArrayLike, axis: ArrayLike, radius: float, length: float) -> Tool:
    """Cylinder about ``axis`` through ``centre`` [mm], without caps."""
    return Tool(CYLINDER, np.array(centre, float), axes_along(axis), (radius, 0.5 * length, 0.0, 0.0))


def sampled(origin: ArrayLike, spacing: float, samples: Array) -> Tool:
    """A shape by its signed distance [mm] at a regular grid (nx, ny, nz) of ``spacing`` from ``origin``."""
    return Tool(GRID, np.array(origin, float), np.eye(3), (spacing, 0.0, 0.0, 0.0), samples=np.asarray(samples, float))


def swept(
    origin: ArrayLike, spacing: float, samples: Array, radius: float, draft: float = 0.0, down: bool = False
) -> Tool:
    """A rounded edge swept along an outline: a body with its flat face up (or ``down``) at the height of ``origin``.

    ``samples`` (nx, ny) are the distances in plan from the sharp edge [mm], negative over the face, at a regular grid
    of ``spacing`` from ``origin`` (3,). ``radius`` of the edge [mm]; the wall leans outwards, away from the face, by
    ``draft`` [rad]. The body has no end away from its face.
    """
    axes = np.diag([1.0, 1.0, -1.0 if down else 1.0])
    size = (spacing, radius, sin(draft), cos(draft))
    samples = np.asarray(samples, float)
    plan = _plan_box(samples, spacing, radius * (1.0 - sin(draft)) / cos(draft))
    return Tool(SWEPT, np.array(origin, float), axes, size, samples=samples[:, :, None], plan=plan)


def _plan_box(samples: Array, spacing: float, reach: float) -> tuple[float, float, float, float, float]:
    """``Tools.plan`` of a swept edge whose rounding reaches ``reach`` [mm] over the face: one spacing is to spare."""
    border = np.concatenate([samples[0], samples[-1], samples[:, 0], samples[:, -1]])
    outside = float(np.all(border < -reach))
    found = np.argwhere(samples > -reach if outside else samples <= 0.0)
    if not len(found) or not (outside or border.min() > 0.0):
        return 0.0, 0.0, FAR, FAR, 0.0
    low, high = spacing * (found.min(axis=0) - 1.0), spacing * (found.max(axis=0) + 1.0)
    return (*(0.5 * (low + high)).tolist(), *(0.5 * (high - low)).tolist(), outside)


class Boundary:
    """What acts on ``model``; :meth:`drive` gives it to the kernel. Time step ``dt`` [ms] sets the tools' penalty.

    ``drive`` fixes it: whatever is added later raises :class:`InputError`, as nodes that do not exist and unknown
    degrees of freedom do.
    """

    def __init__(self, model: ExplicitModel, dt: float) -> None:
        self.model, self.dt = model, dt
        self.tables: list[Table] = [constant(0.0)]
        self._motions: list[tuple[Array, ...]] = []
        self._loads: list[tuple[Array, ...]] = []
        self.groups = 0
        self.tools: list[Tool] = []
        self.radius = np.zeros(model.n_nodes)
        self._driven = False

    def table(self, table: Table) -> int:
        """Number of a table, for :class:`Tool`."""
        self._open("a table")
        self.tables.append(table)
        return len(self.tables) - 1

    def move(
        self, nodes: ArrayLike, dofs: str | Sequence[str], table: Table | None = None, scale: ArrayLike = 1.0
    ) -> int:
        """Prescribe velocities [mm/ms, rad/ms] of ``nodes``: ``scale`` (n,) times ``table`` (default: held).

        Returns the number under which the reactions are summed, each times its scale: conjugate to the table.
        """
        self._open("a motion")
        node = node_numbers(nodes, self.model.n_nodes)
        names = names_among(dofs, ALL, "degree of freedom")
        share = _one_each(scale, "scale of a motion", node)
        number = 0 if table is None else self.table(table)
        for dof in names:
            rows = np.broadcast_arrays(node, DOFS[dof], number, share, self.groups)
            self._motions.append(tuple(np.array(r) for r in rows))
        self.groups += 1
        return self.groups - 1

    def grip(self, nodes: ArrayLike, dof: str, table: Table | None = None) -> int:
        """Clamp all degrees of freedom of ``nodes`` in a massless jaw that moves along ``dof``, as :meth:`move` does.

        Cheaper than moving six degrees of freedom; only the reactions along ``dof`` are summed.
        """
        group = self.move(nodes, dof, table)
        for array in (self.model.nodes.inv_mass, self.model.nodes.inv_inertia, self.model.mass, self.model.inertia):
            array[np.asarray(nodes)] = 0.0
        return group

    def load(self, nodes: ArrayLike, dof: str, value: ArrayLike, table: Table | None = None) -> None:
        """Force [N] or moment [N mm] ``value`` (n,) times ``table`` (default: constant 1) on ``nodes``."""
        self._open("a load")
        node = node_numbers(nodes, self.model.n_nodes)
        (name,) = names_among(dof, ALL, "degree of freedom")
        size = _one_each(value, "value of a load", node)
        rows = np.broadcast_arrays(node, DOFS[name], self.table(table or constant(1.0)), size)
        self._loads.append(tuple(np.array(r) for r in rows))

    def still_moving(self) -> list[int]:
        """Numbers of the motions whose tables do not end at rest."""
        last = np.array([table.value[-1] for table in self.tables])
        return sorted({int(g) for _, _, t, s, group in self._motions for g in group[(s * last[t.astype(int)]) != 0.0]})

    def _open(self, what: str) -> None:
        if self._driven:
            raise InputError(f"{what} is added after the start and would do nothing: add it before the first step")

    def gravity(self, weight: Array, direction: ArrayLike = (0.0, 0.0, -1.0), table: Table | None = None) -> None:
        """Weight [N] of each node, (n_nodes,), along ``direction``."""
        for dof, share in zip("xyz", np.asarray(direction, float), strict=True):
            if share != 0.0:
                self.load(np.arange(self.model.n_nodes), dof, share * weight, table)

    def add_tool(self, tool: Tool) -> int:
        """Add a rigid tool; returns its number."""
        self._open("a tool")
        self.tools.append(tool)
        return len(self.tools) - 1

    def move_tool(self, number: int, axes: str | Sequence[str], velocity: Table) -> None:
        """Move tool ``number`` along ``axes`` (x, y, z) with ``velocity`` [mm/ms]; it is held along the others."""
        table = self.table(velocity)
        for axis in names_among(axes, ALL[:3], "axis"):
            self.tools[number].motion[DOFS[axis]] = table

    def free_tool(
        self, number: int, axes: str | Sequence[str], mass: float, force: Table | None = None, drag: float = 0.0
    ) -> None:
        """Let tool ``number`` of ``mass`` [g] move along ``axes`` (x, y, z) under what it touches, ``force`` [N] along
        each and a ``drag`` [1/ms] in proportion to its momentum.
        """
        if not (np.isfinite(mass) and mass > 0.0):
            raise InputError(f"mass of a free tool: {mass:g} g; expected more than 0")
        tool, load = self.tools[number], -1 if force is None else self.table(force)
        tool.mass, tool.drag = mass, drag
        for axis in names_among(axes, ALL[:3], "axis"):
            tool.motion[DOFS[axis]], tool.load[DOFS[axis]] = FREE, load

    def drive(self) -> Drive:
        """All of it in the form of the kernel."""
        self._driven = True
        knots = np.array([len(t.time) for t in self.tables])
        time, value = np.zeros((2, len(self.tables), knots.max()))
        for k, table in enumerate(self.tables):
            time[k, : knots[k]], value[k, : knots[k]] = table.time, table.value
        motions = self._sorted(self._motions, (np.int64, np.int64, np.int64, np.float64, np.int64))
        loads = in_runs(*self._sorted(self._loads, (np.int64, np.int64, np.int64, np.float64), runs=True))
        tables = Tables(knots, time, value, np.zeros((2, len(self.tables))))
        return Drive(tables, Motions(*motions), loads, _tool_arrays(self.tools), self._touch())

    def _sorted(self, groups: list[tuple[Array, ...]], kinds: tuple[type, ...], runs: bool = False) -> list[NDArray]:
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

    def _touch(self) -> Touch:
        n, n_tools = self.model.n_nodes, len(self.tools)
        mass = np.where(self.model.mass > 0.0, self.model.mass, 0.0)
        stiffness = TOOL_STIFFNESS * mass / self.dt**2
        viscous = 2.0 * TOOL_DAMPING * np.sqrt(stiffness * mass)
        return Touch(
            self.radius, stiffness, viscous, np.zeros((n_tools, 3, n)), np.zeros((n_tools, n)), np.zeros((n_tools, n))
        )


def _one_each(values: ArrayLike, name: str, node: Index) -> Array:
    """Finite ``values``, one for all or one a node."""
    array = finite(values, name)
    if array.shape not in ((), (1,), node.shape):
        raise InputError(f"{name}: {array.shape} numbers for {len(node)} nodes; expected one, or one a node")
    return array


def _tool_arrays(tools: list[Tool]) -> Tools:
    counts = np.array([t.samples.shape for t in tools], np.int64).reshape(-1, 3)
    offset = np.concatenate([[0], np.cumsum(counts.prod(axis=1))]).astype(np.int64)

    def rows(values: list, width: tuple[int, ...], kind: type = float) -> NDArray:
        return np.array(values, kind).reshape(len(tools), *width)

    return Tools(
        kind=rows([t.kind for t in tools], (), np.int64),
        size=rows([t.size for t in tools], (4,)),
        axes=rows([t.axes for t in tools], (3, 3)),
        plan=rows([t.plan for t in tools], (5,)),
        position=rows([t.position for t in tools], (3,)),
        velocity=np.zeros((len(tools), 3)),
        motion=rows([t.motion for t in tools], (3,), np.int64),
        load=rows([t.load for t in tools], (3,), np.int64),
        mass=rows([t.mass for t in tools], ()),
        drag=rows([t.drag for t in tools], ()),
        law=rows([[t.stiffness, 0.5 * t.stiffness, *t.friction] for t in tools], (4,)),
        grid=np.column_stack([offset[:-1], counts]),
        samples=np.concatenate([np.zeros(0), *(t.samples.ravel() for t in tools)]),
    )


def new_tally(boundary: Boundary) -> Tally:
    """Empty accumulators for ``boundary``."""
    n_tools, groups = len(boundary.tools), (PARTITIONS, max(boundary.groups, 1))
    return Tally(
        np.zeros(groups), np.zeros((PARTITIONS, 4)), np.zeros((PARTITIONS, n_tools, 3)), np.zeros((n_tools, 3)),
        np.zeros(groups),
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
        """From the flat form that :func:`take_readings` gives."""
        tools = row[len(row) - 6 * n_tools :].reshape(2, n_tools, 3)
        return cls(row[: len(row) - 6 * n_tools], tools[0], tools[1])


def take_readings(tally: Tally, drive: Drive, steps: int) -> Array:
    """Flat means over ``steps`` of what ``tally`` has summed, which is reset."""
    row = np.concatenate(
        [tally.reaction.sum(axis=0) / steps, tally.tool_sum.ravel() / steps, drive.tools.position.ravel()]
    )
    tally.reaction[:], tally.tool_sum[:], tally.support[:] = 0.0, 0.0, 0.0
    return row
