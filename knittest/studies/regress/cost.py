"""Table 4: elements and CPU hours of the paper beside ours, from different machines; shown, not judged."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from knittest.base.kinds import names
from knittest.base.resources import data_dir
from knittest.experiment.tables import published
from knittest.studies.regress.cases import Case
from knittest.studies.trials.record import Record

SOURCE, VARIANT = "pham2019", "1"


@dataclass(frozen=True)
class CostRow:
    """A test at a scale; ``note`` says why there are no numbers of ours (NaN), or of what size the model is."""

    test: str
    scale: str
    paper_elements: float
    paper_cpu_h: float
    elements: float
    cpu_h: float
    note: str


def table4_rows(done: Mapping[Case, Record]) -> Iterator[CostRow]:
    """All rows of Table 4 at the scales among ``done``, each with the run of variant 1 that has its cost."""
    scales = [scale for scale in ("macro", "meso") if any(case.scale == scale for case in done)]
    for test in names():
        for scale in scales:
            name = f"{test.replace('-', '_')}_{scale}"
            elements, cost = f"{name}_elements", f"{name}_cost"
            paper = {row.quantity: row.mean for row in published(data_dir() / SOURCE, VARIANT, "", (elements, cost))}
            case = next((c for c in done if (c.test, c.scale) == (test, scale) and 4 in c.tables), None)
            ours = _ours(test, case, done)
            yield CostRow(test, scale, paper.get(elements, math.nan), paper.get(cost, math.nan), *ours)


def _ours(test: str, case: Case | None, done: Mapping[Case, Record]) -> tuple[float, float, str]:
    if case is None:
        return math.nan, math.nan, "not run at this level"
    record = done[case]
    cost = record.cost
    if cost is None:
        return math.nan, math.nan, f"no result: {record.status}"
    return cost["elements"], cost["cpu_s"] / 3600.0, f"preset {case.preset}"
