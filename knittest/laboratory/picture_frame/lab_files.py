"""Files of picture frames as ``knittest data`` takes them, and the rig that they say they come from."""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from knittest.experiment.lab_conditions import FABRIC_SIDE, FRAME_SIDE
from knittest.experiment.lab_kind import LabTest, Rigs
from knittest.experiment.lab_numbers import plain
from knittest.laboratory.picture_frame.lab_curves import Sheared, read_frames
from knittest.laboratory.picture_frame.lab_fabric import NAME, fabric_of
from knittest.laboratory.picture_frame.lab_report import END, frame_lines, write_frames

_SHEARED = re.compile(r"shear[ _-]*angle|scherwinkel|picture[ _-]*frame|(?<![a-z])scherrahmen", re.I)
_NAMED = re.compile(r"(?<![a-z])(picture|frame|rahmen|scher)", re.I)


def _write(specimens: Sequence[Sheared], out: Path, direction: str, files: Sequence[str], trusted: bool) -> str:
    return write_frames(specimens, out, files)


def _looks(cells: Sequence[str]) -> bool:
    return any(FRAME_SIDE.names(cell, 0) or _SHEARED.search(cell) for cell in cells)


def _rigs(tests: Mapping[str, dict[str, Any]]) -> Rigs:
    return {NAME: _frame(tests[NAME])} if NAME in tests else {}


def _frame(test: Mapping[str, Any]) -> dict[str, float]:
    """Both sides, and the angle that all specimens reach."""
    sides = test["conditions"]
    found = {"side": sides[FABRIC_SIDE.key], "frame_side": max(sides[FRAME_SIDE.key], sides[FABRIC_SIDE.key])}
    if END in test:
        found["max_angle"] = math.floor(10.0 * min(test[END]["values"])) / 10.0
    return {name: plain(value) for name, value in found.items()}


LAB = LabTest(
    read_frames,
    frame_lines,
    _write,
    (FRAME_SIDE, FABRIC_SIDE),
    ("sign", "zero", "preload", "loading"),
    _looks,
    _NAMED,
    _rigs,
    fabric_of,
)
