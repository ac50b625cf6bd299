"""All that a regression found, and as plain data for ``--json`` and ``regress.json``."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from knittest.base.errors import OutOfTolerance, ResourceError
from knittest.experiment.row_kind import RowKind
from knittest.export.provenance import cpu_model, git_commit
from knittest.studies.regress.cases import Case, Level
from knittest.studies.regress.cost import CostRow
from knittest.studies.regress.drift import Change, Drift
from knittest.studies.regress.judge import Row
from knittest.studies.trials.record import Record

#: what is said of an entry of no run
LOST = "in the baseline, but no level runs it any more: --update-baseline drops it"


@dataclass(frozen=True)
class Outcome:
    """Records of the runs, rows of both tables (none: not asked for), and drift against the file ``baseline``: what was
    ``updated``, entries ``lost``, which no level runs, and those that the update ``dropped`` for it.
    """

    level: Level
    records: Mapping[Case, Record]
    rows: tuple[Row, ...]
    costs: tuple[CostRow, ...]
    drifts: tuple[Drift, ...]
    baseline: Path
    updated: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()

    @property
    def failures(self) -> int:
        """Rows and cases that do not pass, and entries that no level runs any more."""
        return (
            sum(not row.passed for row in self.rows) + sum(not drift.passed for drift in self.drifts) + len(self.lost)
        )

    @property
    def exit_code(self) -> int:
        """0; 5 when something does not pass; 4 when all that does not is runs for which there was no room."""
        drifted = any(not drift.passed and not drift.no_room for drift in self.drifts)
        if any(drift.no_room for drift in self.drifts) and not drifted and not self.lost:
            return ResourceError.exit_code
        return OutOfTolerance.exit_code if self.failures else 0

    def tally(self, kind: RowKind) -> tuple[int, int]:
        """Number of rows of ``kind`` that pass, and of all of them."""
        rows = [row for row in self.rows if row.kind == kind]
        return sum(row.passed for row in rows), len(rows)

    def to_dict(self) -> dict[str, object]:
        """Outcome as plain data; its keys are a contract."""
        return {
            "passed": self.exit_code == 0,
            "exit_code": self.exit_code,
            "level": self.level,
            "commit": git_commit(),
            "cpu": cpu_model(),
            "table3": [_row(row) for row in self.rows],
            "table4": [asdict(row) for row in self.costs],
            "drift": list(self._drift()),
            "baseline": {
                "file": str(self.baseline),
                "updated": list(self.updated),
                "lost": list(self.lost),
                "dropped": list(self.dropped),
            },
            "runs": [_run(case, record) for case, record in self.records.items()],
        }

    def _drift(self) -> Iterator[dict[str, object]]:
        for drift in self.drifts:
            yield {
                "run": drift.case.name,
                "judged": bool(drift.changes),
                "passed": drift.passed,
                "reasons": drift.reasons,
                "changes": [asdict(change) for change in drift.changes],
                "baseline_commit": drift.entry.commit if drift.entry else None,
                "baseline_cpu": drift.entry.cpu if drift.entry else None,
            }


def _row(row: Row) -> dict[str, object]:
    data = asdict(row)
    return {"run": row.case.name} | {k: v for k, v in data.items() if k != "case"} | {"passed": row.passed}


def _run(case: Case, record: Record) -> dict[str, object]:
    return {**asdict(case), "run": case.name, "status": record.status, "reason": record.reason,
            "seconds": record.seconds, "key": record.key}  # fmt: skip


def largest_of(drifts: list[Drift]) -> Change | None:
    """The change among ``drifts`` that is largest, crests left out, which have no shares."""
    changes = [c for drift in drifts for c in drift.changes if c.counted is None]
    return max(changes, key=lambda c: abs(c.change) if math.isfinite(c.change) else math.inf, default=None)
