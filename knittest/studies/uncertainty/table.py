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
    """Point, its place in the design, values of the parameters, every variable; status, reason, folder of each run.

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
        for one in fabrics:
            status, reason = one.ended(records)
            place = f"{TRIALS}/{one.trial.key}" if one.trial else ""
            line |= {f"{one.fabric} status": status, f"{one.fabric} reason": reason, f"{one.fabric} folder": place}
        lines.append(line)
    text = io.StringIO()
    pd.DataFrame(lines).to_csv(text, index=False, float_format="%.10g")
    write_atomic(folder / TABLE, text.getvalue())
