"""Clamps of the pull-out test at the frames of a run: on edges of the piece, and on the inlay that is pulled."""

from collections.abc import Mapping

import numpy as np

from knittest.base.history import Body, History
from knittest.laboratory.apparatus import at_frames, jaw, plate_block

#: facts of the piece: node that is pulled, width of it across the inlay, and of the edges that are clamped
CLAMPS = ("pulled_node", "piece_width_mm", "clamped_edge_mm")


def clamps(history: History, facts: Mapping[str, float], axis: int, sides: bool) -> list[Body]:
    """Clamps on both sides of the piece, or on its far end, and on the end of the inlay, which is pulled along ``axis``
    (0: x, 1: y).
    """
    still = np.zeros((len(history.frames), 3))
    edge, far = facts["clamped_edge_mm"], facts["piece_width_mm"] - facts["clamped_edge_mm"]
    if sides:
        held = [
            jaw("first side clamp", history, 1 - axis, (edge, -1.0), still, aside=0.0),
            jaw("second side clamp", history, 1 - axis, (far, 1.0), still, aside=0.0),
        ]
    else:
        held = [jaw("far clamp", history, axis, (edge, -1.0), still)]
    return [*held, _on_the_inlay(history, facts, axis)]


def _on_the_inlay(history: History, facts: Mapping[str, float], axis: int) -> Body:
    """A cube as wide as a clamped edge, which the inlay ends at."""
    wide = facts["clamped_edge_mm"]
    centre = history.frames[0].position[int(facts["pulled_node"])].copy()
    centre[axis] += 0.5 * wide
    offset = np.zeros((len(history.frames), 3))
    offset[:, axis] = at_frames(history, "displacement_mm")
    return plate_block("inlay clamp", centre, np.full(3, wide), offset)
