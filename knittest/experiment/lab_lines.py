"""Lines of the tables that imports print."""

from collections.abc import Sequence

import numpy as np

from knittest.experiment.statistics import mean_sd

#: name and values, one of each column
NamedRow = tuple[str, Sequence[float]]


def table_lines(heads: Sequence[tuple[str, str]], rows: Sequence[NamedRow]) -> list[str]:
    """Specimens, then mean and sd of their columns; ``heads`` are (name, format of the numbers).

    A standard deviation that one specimen has none of is a dash.
    """
    columns = np.array([values for _, values in rows], float).T
    found = np.array([mean_sd(column) for column in columns]).T
    shown = [*rows, ("mean", found[0]), ("sd", found[1])]
    first = max(len("specimen"), *(len(name) for name, _ in rows))
    lines = ["  ".join([f"{'specimen':<{first}}", *(head for head, _ in heads)])]
    for name, values in shown:
        cells = [_cell(value, len(head), form) for value, (head, form) in zip(values, heads, strict=True)]
        lines.append("  ".join([f"{name:<{first}}", *cells]))
    return lines


def _cell(value: float, width: int, form: str) -> str:
    return f"{value:>{width}{form}}" if np.isfinite(value) else f"{'-':>{width}}"
