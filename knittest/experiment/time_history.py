"""Time histories of OpenRadioss as text (/TFILE/3): motions and reaction impulses of nodes (/TH/NODE).

Its engine writes records (engine/source/output/th: hist1.F, hist2.F, wrtdes.F). Each begins with a line ZZZZZEOR and
the counts of what follows: whole numbers (I) of 10 columns, real numbers (R), five a line, or characters (C). The
records before the first time state how many follow at each time: the time, global variables, variables of parts and
subsets, then one record for each group with the variables of each of its members. tools/th_to_csv reads the binary form
of the same records.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.files import read_regular

Array = NDArray[np.float64]

#: begins each record; ends the first line of a file
RECORD, FIRST = "ZZZZZEOR", "FORMAT"
MAX_BYTES = 2_000_000_000
#: type of a group of nodes; codes of its variables: displacements and impulses along x and y
NODES, DX, DY, REACX, REACY = 0, 1, 2, 620, 621
NAMES = {DX: "DX", DY: "DY", REACX: "REACX", REACY: "REACY"}
#: columns of a title, unless a record states them, in a file of version 3041, and of a whole number
TITLE, TITLES, WHOLE = 40, {3041: 80}, 10
#: four bytes, the length of the first record, that begin a binary file
BINARY = b"\x00\x00\x00\x54"
_COUNT = re.compile(r"(\d+|\*+)([IRC])")
#: a real number whose exponent has three digits
_EXPONENT = re.compile(r"(?<=[0-9])(?=[+-]\d{3}$)")


class NodeHistory(NamedTuple):
    """Displacements [mm] and reaction impulses [N ms] along x and y, (n, n_nodes, 2), at ``time`` (n,) [ms]."""

    time: Array
    displacement: Array
    impulse: Array


class _Record(NamedTuple):
    """Counts, such as [(5, I), (100, C)], lines and the number of the first line of a record."""

    counts: list[tuple[str, str]]
    lines: list[str]
    number: int

    def wholes(self, n: int) -> list[int]:
        text = "".join(self.lines)
        return [int(text[k : k + WHOLE]) for k in range(0, n * WHOLE, WHOLE)]

    def reals(self) -> list[float]:
        return [_real(word) for line in self.lines for word in line.split()]


def is_time_history(path: Path) -> bool:
    """Tell whether ``path`` is a time history of OpenRadioss as text; raises :class:`InputError` for a binary one."""
    try:
        with path.open("rb") as file:
            head = file.read(4096)
    except OSError:
        return False  # the reader of curves states why
    if head.startswith(BINARY):
        raise InputError(
            f"{path}: a binary time history of OpenRadioss; write /TFILE/3 in its engine file and run the engine again"
        )
    lines = head.decode("ascii", "replace").splitlines()
    return len(lines) > 1 and lines[0].rstrip().endswith(FIRST) and lines[1].startswith(RECORD)


def read_time_history(path: Path) -> NodeHistory:
    """Read the nodes of a time history; raises :class:`InputError` where it has none, or not all their variables.

    What an interrupted run has written of its last time is left out.
    """
    lines = read_regular(path, MAX_BYTES, "a time history has fewer nodes").decode("ascii", "replace").splitlines()
    records = _records(path, lines)
    try:
        columns = _read_header(records)
        steps = list(_read_steps(records, columns))
    except (IndexError, ValueError) as error:
        raise InputError(f"{path}: not a time history as OpenRadioss writes it with /TFILE/3: {error}") from None
    if columns.variables is None:
        raise InputError(f"{path}: no group of nodes; expected /TH/NODE as in the starter file of knittest")
    if absent := [name for code, name in NAMES.items() if code not in columns.variables]:
        raise InputError(f"{path}: /TH/NODE has no {', '.join(absent)}; expected {', '.join(NAMES.values())}")
    time = np.array([time for time, _ in steps])
    later = np.flatnonzero(np.append(True, time[1:] > np.maximum.accumulate(time)[:-1])) if len(time) else time
    if len(later) < 3:
        raise InputError(f"{path}: {len(later)} times; at least three are needed")
    values = np.array([values for _, values in steps])[later].reshape(len(later), -1, len(columns.variables))
    if not np.isfinite(values).all():
        raise InputError(f"{path}: a value is not finite: the run has failed; repeat it with a smaller time step")
    at = [columns.variables.index(code) for code in NAMES]
    return NodeHistory(time[later], values[:, :, at[:2]], values[:, :, at[2:]])


class _Columns(NamedTuple):
    """Records at each time, which of them has the nodes, and their variables; the first record of the first time."""

    size: int
    place: int
    variables: list[int] | None
    first: int


def _records(path: Path, lines: list[str]) -> list[_Record]:
    found: list[_Record] = []
    for number, line in enumerate(lines, 1):
        if line.startswith(RECORD):
            found.append(_Record(_COUNT.findall(line[len(RECORD) :]), [], number))
        elif found:
            found[-1].lines.append(line)
    return found


def _read_header(records: list[_Record]) -> _Columns:
    """Read the records before the first time; raises IndexError or ValueError where they are not as expected."""
    at, title = 2, TITLES.get(int(records[0].lines[0][:5]), TITLE)  # behind the title and the date
    if records[at].counts == [("1", "I")]:  # number of additional records, length of titles, units
        title, at = int(records[at + 1].lines[0]), at + 3
    n_parts, n_materials, n_properties, n_subsets, n_groups, n_global = records[at].wholes(6)
    at += 2 if n_global else 1
    of_parts = of_subsets = 0
    for _ in range(n_parts):
        variables = int(records[at].lines[0][WHOLE + title + 15 : WHOLE + title + 20])
        at, of_parts = at + (2 if variables else 1), of_parts + variables
    at += n_materials + n_properties
    for _ in range(n_subsets):
        _, _, children, parts, variables = records[at].wholes(5)
        at, of_subsets = at + 1 + sum(n > 0 for n in (children, parts, variables)), of_subsets + variables
    size = 1 + sum(n > 0 for n in (n_global, of_parts, of_subsets))
    place, nodes = 0, None
    for _ in range(n_groups):
        _, kind, _, members, variables = records[at].wholes(5)
        at += 1 + members
        if variables:
            if kind == NODES and nodes is None:
                place, nodes = size, records[at].wholes(variables)
            at, size = at + 1, size + (members > 0)
    return _Columns(size, place, nodes, at)


def _read_steps(records: list[_Record], columns: _Columns) -> Iterator[tuple[float, list[float]]]:
    """Time and variables of the nodes, those of each node together."""
    count = 0
    for at in range(columns.first, len(records) - columns.size + 1, columns.size):
        (time,) = records[at].reals()
        values = records[at + columns.place].reals()
        count = count or len(values)
        if len(values) != count and at + 2 * columns.size > len(records):
            return  # the last time of an interrupted run
        yield time, values


def _real(word: str) -> float:
    try:
        return float(word)
    except ValueError:
        return float(_EXPONENT.sub("E", word))
