"""Files of bias extension tests as ``knittest data`` takes them, and the rig that they say they come from."""

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from knittest.experiment.lab_conditions import GAUGE, WIDTH
from knittest.experiment.lab_kind import LabTest, Rigs
from knittest.experiment.lab_numbers import plain
from knittest.laboratory.bias_extension.lab_curves import read_strips
from knittest.laboratory.bias_extension.lab_report import END, strip_lines, write_strips

NAME = "bias-extension"
_BIAS = re.compile(r"bias[ _-]*ext|on the bias|(?<![a-z])45 ?°|schrägzug|diagonalzug", re.I)
_NAMED = re.compile(r"(?<![a-z])(bias|schrägzug|diagonalzug)", re.I)


def _write(specimens: Sequence[Any], out: Path, direction: str, files: Sequence[str], trusted: bool) -> str:
    return write_strips(specimens, out, files)


def _looks(cells: Sequence[str]) -> bool:
    return any(_BIAS.search(cell) for cell in cells)


def _rigs(tests: Mapping[str, dict[str, Any]]) -> Rigs:
    return {NAME: _strip(tests[NAME])} if NAME in tests else {}


def _strip(test: Mapping[str, Any]) -> dict[str, float]:
    """Both lengths, and the angle that all specimens reach."""
    sizes = test["conditions"]
    end = math.floor(10.0 * min(test[END]["values"])) / 10.0
    found = {"gauge_length": sizes[GAUGE.key], "width": sizes[WIDTH.key], "max_angle": end}
    return {name: plain(value) for name, value in found.items()}


LAB = LabTest(read_strips, strip_lines, _write, (WIDTH, GAUGE), ("sign", "zero", "preload"), _looks, _NAMED, _rigs)
