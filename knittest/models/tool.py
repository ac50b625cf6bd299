"""Rigid tools by shape as the kernel reads them, and functions of time that motions and loads follow."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from knittest.base.arrays import Array
from knittest.base.errors import InputError
from knittest.kernels.state import CYLINDER, GRID, PLANE, PLATE, SWEPT, Tables, Tools
from knittest.kernels.tool_contact import HELD
from knittest.kernels.tool_shapes import FAR
from knittest.models.inputs import direction, finite_array, number_above, orthonormal


@dataclass(frozen=True)
class Table:
    """Piecewise linear function of time: ``time`` [ms] and ``value``, (n_knots,); constant outside.

    A rig may replace it during a test by one of up to ``room`` knots more.
    """

    time: tuple[float, ...]
    value: tuple[float, ...]
    room: int = 0

    def __post_init__(self) -> None:
        time, value = (
            finite_array(self.time, "time of a table", (-1,)),
            finite_array(self.value, "value of a table", (-1,)),
        )
        if len(time) != len(value) or not len(time):
            raise InputError(f"a table has {len(time)} times and {len(value)} values; expected one value a time")
        if (np.diff(time) < 0.0).any():
            raise InputError(f"times of a table must not fall, got {self.time}")

    def integral(self, time: float) -> float:
        """Integral from 0 to ``time`` [ms]: the travel of a velocity table."""
        return float(self._from_first_knot(time) - self._from_first_knot(0.0))

    def _from_first_knot(self, time: float) -> float:
        """Integral from the first knot to ``time`` [ms]; called after every few steps, so that it uses no arrays."""
        k = bisect_right(self.time, time) - 1
        if k < 0:
            return self.value[0] * (time - self.time[0])
        since, rate = time - self.time[k], self.value[k]
        if k + 1 < len(self.time):
            rate += 0.5 * (self.value[k + 1] - rate) * since / (self.time[k + 1] - self.time[k])
        return self._integrals[k] + rate * since

    @cached_property
    def _integrals(self) -> list[float]:
        """Integrals from the first knot to each."""
        knots, value = self._arrays
        return [0.0, *np.cumsum(0.5 * (value[1:] + value[:-1]) * np.diff(knots)).tolist()]

    def at(self, time: float) -> float:
        """Value at ``time`` [ms]."""
        return float(np.interp(time, *self._arrays))

    def continued(self, begin: float, time: Sequence[float], value: Sequence[float]) -> "Table":
        """The same up to ``begin`` [ms], then through the knots ``time`` [ms] and ``value``."""
        kept = int(np.searchsorted(self._arrays[0], begin))
        return Table((*self.time[:kept], begin, *time), (*self.value[:kept], self.at(begin), *value))

    @cached_property
    def _arrays(self) -> tuple[Array, Array]:
        return np.array(self.time), np.array(self.value)


def put_table(tables: Tables, number: int, table: Table) -> None:
    """Write ``table`` into row ``number`` of the kernel's ``tables``, which must have room for it."""
    knots = len(table.time)
    tables.time[number, :knots], tables.value[number, :knots] = table.time, table.value
    tables.knots[number] = knots


def constant(value: float) -> Table:
    """A function that does not change."""
    return Table((0.0,), (value,))


def ramp(duration: float, value: float, knots: int = 64) -> Table:
    """Ramp from 0 to ``value`` over ``duration`` [ms] by the quintic 10 u^3 - 15 u^4 + 6 u^5, then constant."""
    number_above(duration, "duration of a ramp [ms]", equal=True)
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
    #: the boundary that numbered its motion and load
    moved_in: object = None


def axes_along(third: ArrayLike) -> Array:
    """Orthonormal axes as rows, the last along ``third`` (3,)."""
    third = direction(third, "normal or axis of a tool")
    first = np.eye(3)[np.argmin(np.abs(third))]
    first = first - (first @ third) * third
    first /= np.linalg.norm(first)
    return np.array([first, np.cross(third, first), third])


def plane(point: ArrayLike, normal: ArrayLike) -> Tool:
    """Half space below the plane through ``point`` [mm] with outward ``normal``."""
    return Tool(PLANE, finite_array(point, "point of a plane", (3,)).copy(), axes_along(normal))


def plate(centre: ArrayLike, lengths: ArrayLike, edge_radius: float, axes: ArrayLike | None = None) -> Tool:
    """Box of side ``lengths`` (3,) about ``centre`` with rounded edges [mm]."""
    half = 0.5 * finite_array(lengths, "lengths of a plate", (3,))
    number_above(float(half.min()), "half the least length of a plate")
    number_above(edge_radius, "edge_radius of a plate", equal=True)
    return Tool(
        PLATE, finite_array(centre, "centre of a plate", (3,)).copy(), np.eye(3) if axes is None else orthonormal(axes),
        (*half, edge_radius),
    )  # fmt: skip


def cylinder(centre: ArrayLike, axis: ArrayLike, radius: float, length: float) -> Tool:
    """Cylinder about ``axis`` through ``centre`` [mm], without caps."""
    size = number_above(radius, "radius of a cylinder"), 0.5 * number_above(length, "length of a cylinder"), 0.0, 0.0
    return Tool(CYLINDER, finite_array(centre, "centre of a cylinder", (3,)).copy(), axes_along(axis), size)


def sampled(origin: ArrayLike, spacing: float, samples: Array) -> Tool:
    """A shape by its signed distance [mm] at a regular grid (nx, ny, nz) of ``spacing`` from ``origin``."""
    return Tool(GRID, np.array(origin, float), np.eye(3), (spacing, 0.0, 0.0, 0.0), samples=np.asarray(samples, float))


def swept_edge_tool(
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


def tool_arrays(tools: list[Tool]) -> Tools:
    """``tools`` in the form of the kernel."""
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
