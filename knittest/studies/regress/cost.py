"""Table 4: elements and CPU hours of the paper beside ours, from different machines; shown, not judged."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

from knittest.base.kinds import names
from knittest.studies.regress.cases import Case, paper_cost
from knittest.studies.trials.record import Record


@dataclass(frozen=True)
class CostRow:
    """A test at a scale; ``note`` says why there are no numbers of ours (NaN), or of what size the model is and whether
    its gates passed. ``added_mass`` [%] is that of mass scaling.
    """

    test: str
    scale: str
    paper_elements: float
    paper_cpu_h: float
    elements: float
    cpu_h: float
    steps: float
    added_mass: float
    note: str


def table4_rows(done: Mapping[Case, Record]) -> Iterator[CostRow]:
    """All rows of Table 4 at the scales among ``done``, each with the run of variant 1 that has its cost."""
    scales = [scale for scale in ("macro", "meso") if any(case.scale == scale for case in done)]
    for test in names():
        for scale in scales:
            if (paper := paper_cost(test, scale)) is None:
                continue
            case = next((c for c in done if (c.test, c.scale) == (test, scale) and 4 in c.tables), None)
            elements, cpu_h = paper
            yield CostRow(test, scale, elements, cpu_h, *_ours(case, done))


def total(rows: Iterable[CostRow]) -> tuple[float, float]:
    """CPU hours of the paper and ours, of the ``rows`` that have both."""
    both = [(row.paper_cpu_h, row.cpu_h) for row in rows if math.isfinite(row.cpu_h) and math.isfinite(row.paper_cpu_h)]
    return sum(paper for paper, _ in both), sum(ours for _, ours in both)


def _ours(case: Case | None, done: Mapping[Case, Record]) -> tuple[float, float, float, float, str]:
    if case is None:
        return *(math.nan,) * 4, "not run at this level"
    record = done[case]
    if record.summary is None:
        return *(math.nan,) * 4, f"no result: {record.status}"
    cost, added = record.summary["cost"], record.summary["quality"].get("added_mass_pct")
    passed = "gates passed" if record.status == "completed" else record.status
    said = ", ".join(part for part in (f"preset {case.preset}", case.label, passed) if part)
    return cost["elements"], cost["cpu_s"] / 3600.0, cost["steps"], math.nan if added is None else added, said
