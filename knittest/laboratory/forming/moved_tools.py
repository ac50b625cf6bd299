"""Stamp, die and holder at the frames of a run."""

import numpy as np

from knittest.base.history import Body, History
from knittest.laboratory.apparatus import at_frames
from knittest.tooling.toolset import ToolSet

#: column of the curve with the travel of a tool [mm], and which way along z it counts; the die stays
TRAVEL = {"stamp": ("stamp_travel_mm", -1.0), "holder": ("holder_travel_mm", 1.0)}


def moved_tools(tools: ToolSet, history: History) -> list[Body]:
    """Meshes of ``tools``, moved by their travel at the times of the frames, between rows of the curve by the line
    through them.
    """
    found = []
    for name, tool in tools.by_name.items():
        offset = np.zeros((len(history.frames), 3))
        if name in TRAVEL:
            column, way = TRAVEL[name]
            offset[:, 2] = way * at_frames(history, column)
        found.append(Body(name, tool.solid.points, tool.solid.triangles, offset))
    return found
