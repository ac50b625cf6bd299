"""Files of pull-outs as ``knittest data`` takes them."""

import re
from collections.abc import Sequence

from knittest.experiment.lab_conditions import CROSSING_DENSITY, EMBEDDED
from knittest.experiment.lab_kind import LabTest
from knittest.laboratory.pull_out.lab_pulls import FREE_END, read_pulls
from knittest.laboratory.pull_out.lab_report import pull_lines, write_pulls

_PULLED = re.compile(r"pull[- _]?out(?!\w)|aus(zug|zieh)s?(versuch|kraft|test)", re.I)
_NAMED = re.compile(r"pull[- _]?out|auszug|auszieh", re.I)


def _looks(cells: Sequence[str]) -> bool:
    return any(EMBEDDED.names(cell, 0) or FREE_END.search(cell) or _PULLED.search(cell) for cell in cells)


# no rigs: a preset gives the piece its size
LAB = LabTest(
    read_pulls, pull_lines, write_pulls, (EMBEDDED, CROSSING_DENSITY), ("sign", "zero", "preload", "clamped"), _looks,
    _NAMED,
)  # fmt: skip
