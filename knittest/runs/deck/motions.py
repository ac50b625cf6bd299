"""Motions and loads of a deck: what holds, moves and loads its nodes, with the curves they follow."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.export.keywords import KeywordFile
from knittest.kernels.drive_state import ALONG, Drive
from knittest.models.explicit_model import ExplicitModel
from knittest.models.table import Table

Array = NDArray[np.float64]

#: degrees of freedom of the target by those of the kernel
DOF = (1, 2, 3, 5, 6, 7)
AXES = ("x", "y", "z", "rx", "ry", "rz")
#: what a curve goes on beyond the end of the run, and how far a knot is moved off the one before, over its duration
SPARE, NUDGE = 0.01, 1e-9
VELOCITY = 0


def add_curve(deck: KeywordFile, title: str, table: Table, end: float) -> int:
    """Add ``table`` from 0 to beyond ``end`` [ms], where the target would let it fall to 0; returns its number."""
    time, value = np.array(table.time, float), np.array(table.value, float)
    last = end * (1.0 + SPARE)
    inside = (time > 0.0) & (time < last)
    ends = np.interp([0.0, last], time, value)
    time, value = np.concatenate([[0.0], time[inside], [last]]), np.concatenate([ends[:1], value[inside], ends[1:]])
    same = np.append(False, (np.diff(time) == 0.0) & (np.diff(value) == 0.0))
    time, value = time[~same], value[~same]
    time = time + NUDGE * end * np.cumsum(np.append(False, np.diff(time) == 0.0))
    return deck.curve(title, time, value)


def add_node_set(deck: KeywordFile, title: str, nodes: Iterable[int]) -> int:
    """Add a set of ``nodes`` as the model numbers them; returns its number."""
    number = deck.number_for("node set")
    deck.keyword("SET_NODE_LIST_TITLE", title)
    deck.card("sid da1 da2 da3 da4 solver", number, 0.0, 0.0, 0.0, 0.0, "MECH")
    deck.numbers(int(n) + 1 for n in nodes)
    return number


def add_motions(deck: KeywordFile, model: ExplicitModel, drive: Drive, tables: list[Table], end: float) -> None:
    """Add all that ``drive`` holds, moves and loads; ``model`` is clamped by it already, ``end`` [ms] that of the test.

    Raises :class:`InputError` for motions along axes of their own.
    """
    node, dof, table = (np.asarray(a) for a in (drive.motions.node, drive.motions.dof, drive.motions.table))
    scale = drive.motions.scale
    if (dof >= ALONG).any():
        raise InputError("deck: motions along axes of their own are not written; expected x, y and z")
    still = (scale == 0.0) | np.array([not any(t.value) for t in tables])[table]
    held = np.zeros((model.n_nodes, 6), bool)
    held[model.mass == 0.0] = True  # gripped: what does not move is held
    held[node[~still], dof[~still]] = False
    held[node[still], dof[still]] = True
    _add_held(deck, held)
    curves: dict[int, int] = {}
    for number, axis in sorted({(int(t), int(d)) for t, d in zip(table[~still], dof[~still], strict=True)}):
        of = ~still & (table == number) & (dof == axis)
        if number not in curves:
            curves[number] = add_curve(deck, f"velocity {number} [mm/ms] over time [ms]", tables[number], end)
        _add_moved(deck, node[of], scale[of], axis, curves[number])
    _add_loads(deck, drive, tables, end)


def _add_held(deck: KeywordFile, held: NDArray[np.bool_]) -> None:
    for flags in np.unique(held[held.any(axis=1)], axis=0):
        names = ", ".join(name for name, flag in zip(AXES, flags, strict=True) if flag)
        nodes = add_node_set(deck, f"held in {names}", np.flatnonzero((held == flags).all(axis=1)))
        deck.keyword("BOUNDARY_SPC_SET")
        deck.card("nsid cid dofx dofy dofz dofrx dofry dofrz", nodes, 0, *(int(f) for f in flags))


def _add_moved(deck: KeywordFile, node: Array, scale: Array, axis: int, curve: int) -> None:
    """One set where all move alike, else a row a node with its share of the curve."""
    if np.all(scale == scale[0]):
        rows = [(add_node_set(deck, f"moved along {AXES[axis]}", node), DOF[axis], VELOCITY, curve, float(scale[0]))]
        deck.keyword("BOUNDARY_PRESCRIBED_MOTION_SET")
    else:
        rows = [(int(n) + 1, DOF[axis], VELOCITY, curve, float(s)) for n, s in zip(node, scale, strict=True)]
        deck.keyword("BOUNDARY_PRESCRIBED_MOTION_NODE")
    deck.rows("id dof vad lcid sf", rows)


def _add_loads(deck: KeywordFile, drive: Drive, tables: list[Table], end: float) -> None:
    loads, rows = drive.loads, []
    curves: dict[int, int] = {}
    for first, length, at, dof, table in zip(loads.node, loads.length, loads.at, loads.dof, loads.table, strict=True):
        if int(table) not in curves:
            curves[int(table)] = add_curve(deck, "load over its size", tables[int(table)], end)
        curve, values = curves[int(table)], loads.value[at : at + length]
        rows += [
            (int(first) + k + 1, DOF[int(dof)], curve, float(value))
            for k, value in enumerate(values)
            if value != 0.0  # the target reads a factor of 0 as its default, 1
        ]
    if rows:
        deck.keyword("LOAD_NODE_POINT")
        deck.rows("nid dof lcid sf", rows)
