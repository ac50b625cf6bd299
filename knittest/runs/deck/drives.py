"""Motions and loads of a deck for any solver: constraints, prescribed velocities, guides, curves over time."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.kernels.state import ALONG, Drive
from knittest.models.explicit_model import ExplicitModel
from knittest.models.tool import Table

Array = NDArray[np.float64]
Index = NDArray[np.int64]

AXES = ("x", "y", "z", "rx", "ry", "rz")
#: extension of a curve beyond the end of the run, and shift of a knot off the one before, over the duration
SPARE, NUDGE = 0.01, 1e-9


def knots_of(table: Table, end: float) -> tuple[Array, Array]:
    """Rising times from 0 to beyond ``end`` [ms] and values of ``table``; solvers may take a curve as 0 at its end."""
    time, value = np.array(table.time, float), np.array(table.value, float)
    last = end * (1.0 + SPARE)
    inside = (time > 0.0) & (time < last)
    ends = np.interp([0.0, last], time, value)
    time, value = np.concatenate([[0.0], time[inside], [last]]), np.concatenate([ends[:1], value[inside], ends[1:]])
    same = np.append(False, (np.diff(time) == 0.0) & (np.diff(value) == 0.0))
    time, value = time[~same], value[~same]
    return time + NUDGE * end * np.cumsum(np.append(False, np.diff(time) == 0.0)), value


class Held(NamedTuple):
    """Nodes, from 0 on, that are held in the degrees of freedom whose ``flags`` (6,) are true."""

    flags: NDArray[np.bool_]
    nodes: Index

    @property
    def title(self) -> str:
        """Names of the degrees of freedom."""
        return "held in " + ", ".join(name for name, flag in zip(AXES, self.flags, strict=True) if flag)


class Moved(NamedTuple):
    """Nodes, from 0 on, whose degree of freedom ``axis`` moves with ``scale`` (n,) times table ``table``."""

    table: int
    axis: int
    nodes: Index
    scale: Array


def constraints(model: ExplicitModel, drive: Drive, tables: list[Table]) -> tuple[list[Held], list[Moved]]:
    """Constraints and motions of ``drive``; raises :class:`InputError` for oblique ones."""
    node, dof, table = (np.asarray(a) for a in (drive.motions.node, drive.motions.dof, drive.motions.table))
    scale = drive.motions.scale
    if (dof >= ALONG).any():
        raise InputError("deck: motions along oblique axes are not supported; expected motions along x, y or z")
    still = (scale == 0.0) | np.array([not any(t.value) for t in tables])[table]
    held = np.zeros((model.n_nodes, 6), bool)
    held[model.mass == 0.0] = True  # clamped nodes
    held[node[~still], dof[~still]] = False
    held[node[still], dof[still]] = True
    fixed = [
        Held(flags, np.flatnonzero((held == flags).all(axis=1))) for flags in np.unique(held[held.any(axis=1)], axis=0)
    ]
    moved = []
    for number, axis in sorted({(int(t), int(d)) for t, d in zip(table[~still], dof[~still], strict=True)}):
        of = ~still & (table == number) & (dof == axis)
        moved.append(Moved(number, axis, node[of], scale[of]))
    return fixed, moved


class Load(NamedTuple):
    """Forces ``value`` (n,) times ``table`` along ``axis`` on ``nodes``, from 0 on; of a guide also its scale."""

    table: Table
    axis: int
    nodes: Index
    value: Array
    guides: bool


def loads_of(drive: Drive, tables: list[Table], damping: float) -> Iterator[Load]:
    """Loads of ``drive``. ``damping`` [1/ms] is the rate of mass-proportional damping.

    A guide is a load, too: its momentum times :func:`guide_table`.
    """
    loads = drive.loads
    guides, known = loads.guides == 1, dict[int, Table]()
    for k, (first, length, at) in enumerate(zip(loads.node, loads.length, loads.at, strict=True)):
        number = int(loads.table[k])
        if guides[k] and number not in known:
            known[number] = guide_table(tables[number], damping)
        table = known[number] if guides[k] else tables[number]
        nodes = np.arange(first, first + length)
        yield Load(table, int(loads.dof[k]), nodes, loads.value[at : at + length], bool(guides[k]))


def guide_table(velocity: Table, damping: float) -> Table:
    """Acceleration u' + ``damping`` u over time of a guide of the velocity u.

    It moves a node with the guide, and makes mass-proportional damping act on the velocity relative to it: m v' = f - m
    damping v + m (u' + damping u).
    """
    time, u = np.array(velocity.time), np.array(velocity.value)
    return Table(velocity.time, tuple(np.gradient(u, time) + damping * u))
