"""results.csv of a study: one row a point of the design."""

import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from knittest.base.atomic import write_atomic
from knittest.studies.trials.record import Record
from knittest.studies.trials.runner import TRIALS
from knittest.studies.uncertainty.design import matrix_name
from knittest.studies.uncertainty.problem import Problem
from knittest.studies.uncertainty.runs import Planned, points
from knittest.studies.uncertainty.variables import Numbers

TABLE = "results.csv"


def write_table(
    problem: Problem, runs: Sequence[Planned], records: Mapping[str, Record], numbers: Numbers, folder: Path
) -> None:
    """Point, its place in the design, values of the parameters, every variable; of each run to the full end status and
    reason, and of the one that counts, which may end sooner, the end and the folder.

    Raises :class:`ResourceError`.
    """
    import pandas as pd

    names = [one.name for one in problem.parameters]
    columns = {variable.name: variable.values(numbers) for variable in problem.variables}
    lines = []
    for number, fabrics in enumerate(points(runs), 1):
        first = fabrics[0]
        line: dict[str, object] = {"point": number, "part": matrix_name(first.part, names), "row": first.row + 1}
        line |= dict(zip(names, first.values, strict=True))
        line |= {name: float(values[first.part, first.row]) for name, values in columns.items()}
        lines.append(line | {name: value for one in fabrics for name, value in _ended(problem, one, records).items()})
    text = io.StringIO()
    pd.DataFrame(lines).to_csv(text, index=False, float_format="%.10g")
    write_atomic(folder / TABLE, text.getvalue())


def _ended(problem: Problem, one: Planned, records: Mapping[str, Record]) -> dict[str, object]:
    """Columns on the run ``one``; the folder is that of the full one where none counts."""
    status, reason = one.full.ended(records)
    found: dict[str, object] = {f"{one.fabric} status": status, f"{one.fabric} reason": reason}
    counts = one.last.ended(records)[0] == "completed"
    if problem.shorter.values:
        end = "full" if one.last.end is None else f"{one.last.end:g}"
        found[f"{one.fabric} counts to"] = end if counts else ""
    trial = one.last.trial if counts else one.full.trial
    return found | {f"{one.fabric} folder": f"{TRIALS}/{trial.key}" if trial else ""}
