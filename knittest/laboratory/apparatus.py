"""Rigid parts of a test as frames, view and films show them: blocks of one section, and where they are."""

import numpy as np

from knittest.base.history import Array, Body, History


def block(name: str, section: Array, sides: tuple[float, float], offset: Array, *, along: int = 1) -> Body:
    """A block with the convex ``section`` (k, 2) [mm] in the plane of axis ``along`` (0: x, 1: y) and z, between
    ``sides`` [mm] of the other axis, moved by ``offset`` (n_frames, 3) [mm].
    """
    k = len(section)
    points = np.zeros((2 * k, 3))
    points[:, along], points[:, 2] = np.tile(section, (2, 1)).T
    points[:, 1 - along] = np.repeat(sides, k)
    first = np.arange(1, k - 1)
    lid = np.column_stack([np.zeros_like(first), first, first + 1])
    here, there = np.arange(k), np.roll(np.arange(k), -1)
    around = np.vstack([np.column_stack([here, there, k + there]), np.column_stack([here, k + there, k + here])])
    return Body(name, points, np.vstack([lid, lid + k, around]), offset)


def plate_block(name: str, centre: Array, lengths: Array, offset: Array) -> Body:
    """A plate of ``lengths`` (3,) about ``centre`` (3,) [mm], moved by ``offset`` (n_frames, 3) [mm]."""
    low, high = centre - 0.5 * lengths, centre + 0.5 * lengths
    section = np.array([[low[1], low[2]], [high[1], low[2]], [high[1], high[2]], [low[1], high[2]]])
    return block(name, section, (float(low[0]), float(high[0])), offset)


def at_frames(history: History, column: str) -> Array:
    """Values of a ``column`` of the curve at the times of the frames, (n_frames,), by the line between its rows."""
    times = [frame.time for frame in history.frames]
    return np.asarray(np.interp(times, history.curve["time_ms"], history.curve[column]))
