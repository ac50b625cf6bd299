"""Outcome of a regression: plain data for regress.json, text, and JUnit XML for CI servers."""

import math
import re
import sys
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import asdict, astuple, dataclass
from pathlib import Path

from knittest.base.errors import OutOfTolerance, ResourceError
from knittest.base.files import write_atomic
from knittest.base.layout import table, width_of
from knittest.base.result_rows import LABELS
from knittest.experiment.origin import RowKind
from knittest.export.identity import cpu_model, git_commit
from knittest.studies.regress.cases import Case, Level
from knittest.studies.regress.drift import LIMITS, SCATTER_FACTOR, Drift, own_limits
from knittest.studies.regress.published_tables import CostRow, PublishedRow, total_hours
from knittest.studies.regress.update import limits_of
from knittest.studies.trials.trial import Record

#: problem of an entry without a run
LOST = "in the baseline, but no level runs it any more: remove it with --update-baseline"


@dataclass(frozen=True)
class Outcome:
    """Records of the runs, rows of the requested tables, and drift from the file ``baseline``: lines on ``updated``
    entries, entries ``lost``, which no level runs, and those that the update ``dropped``.
    """

    level: Level
    records: Mapping[Case, Record]
    rows: tuple[PublishedRow, ...]
    costs: tuple[CostRow, ...]
    drifts: tuple[Drift, ...]
    baseline: Path
    updated: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()

    @property
    def failures(self) -> int:
        """Number of failed rows and cases, and of entries that no level runs any more."""
        passed = [row.passed for row in self.rows] + [drift.passed for drift in self.drifts]
        return passed.count(False) + len(self.lost)

    @property
    def exit_code(self) -> int:
        """0; 5 for a failure; 4 if all failures are runs without disk space or memory."""
        drifted = any(not drift.passed and not drift.is_blocked for drift in self.drifts)
        if any(drift.is_blocked for drift in self.drifts) and not drifted and not self.lost:
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
            "table3": [
                {"run": row.case.name} | {k: v for k, v in asdict(row).items() if k != "case"} | {"passed": row.passed}
                for row in self.rows
            ],
            "table4": [asdict(row) for row in self.costs],
            "drift": [
                {
                    "run": drift.case.name,
                    "judged": bool(drift.changes),
                    "passed": drift.passed,
                    "reasons": drift.reasons,
                    "changes": [asdict(change) for change in drift.changes],
                    "baseline_commit": drift.entry.commit if drift.entry else None,
                    "baseline_cpu": drift.entry.cpu if drift.entry else None,
                }
                for drift in self.drifts
            ],
            "baseline": {
                "file": str(self.baseline),
                "updated": list(self.updated),
                "lost": list(self.lost),
                "dropped": list(self.dropped),
            },
            "runs": [
                {**asdict(case), "run": case.name, "status": record.status, "reason": record.reason,
                 "seconds": record.seconds, "key": record.key}
                for case, record in self.records.items()
            ],
        }  # fmt: skip


HEAD3 = ("specimen", "scale", "preset", "quantity", "simulated", "experiment", "deviation", "kind", "passes", "verdict")
HEAD4 = ("test", "scale", "elements, paper", "ours", "CPU h, paper", "ours", "steps", "mass added [%]", "")
RIGHT3, RIGHT4 = (4, 5, 6), (2, 3, 4, 5, 6, 7)


def report_lines(outcome: Outcome) -> Iterator[str]:
    """Lines of the report."""
    if outcome.rows:
        yield "Table 3 of Pham et al. (2019), and F_R/F_N of Eq. 3: mean and sd of the experiment"
        yield from _lines([HEAD3, *map(_table3_cells, outcome.rows)], RIGHT3)
        yield (
            "predicted: no parameter was fitted to the value; tuned: a parameter was fitted to it; input: the value "
            "was given to the model; assumed: assumed parameters decide it"
        )
        yield ""
    if outcome.costs:
        yield "Table 4, variant 1: other machines than in the paper, and another model size unless the preset is paper"
        forms = ("{:.0f}", "{:.0f}", "{:.4g}", "{:.2g}", "{:.0f}", "{:.2g}")
        rows: list[tuple[str, ...]] = [HEAD4]
        for row in outcome.costs:
            numbers = (row.paper_elements, row.elements, row.paper_cpu_h, row.cpu_h, row.steps, row.added_mass)
            rows.append((row.test, row.scale, *map(_number, numbers, forms), row.note))
        yield from _lines(rows, RIGHT4)
        paper, ours = total_hours(outcome.costs)
        yield f"sum of the tests that ran: {paper:.4g} CPU h in the paper, {ours:.2g} here"
        yield ""
    yield from _drift_lines(outcome)
    row_kinds: tuple[RowKind, ...] = ("predicted", "tuned", "input", "assumed")
    tallies = {kind: outcome.tally(kind) for kind in row_kinds}
    counts = [f"{good} of {total} {kind}" for kind, (good, total) in tallies.items() if total]
    words = {0: "PASS", ResourceError.exit_code: "NOT EVALUATED, no disk space or memory"}
    yield words.get(outcome.exit_code, "FAIL") + (f": rows that pass: {', '.join(counts)}" if counts else "")


def _table3_cells(row: PublishedRow) -> tuple[str, ...]:
    label, form = LABELS.get(row.quantity, (row.quantity, "{:.4g}"))
    experiment = _number(row.mean, form) + (f" ± {_number(row.sd, form)}" if math.isfinite(row.sd) else "")
    share = 100.0 * (row.simulated / row.mean - 1.0)
    deviation = f"{row.deviation_sd:+.2f} sd" if math.isfinite(row.deviation_sd) else f"{share:+.1f} %"
    deviation = deviation if math.isfinite(share) else "-"
    verdict = "pass" if row.passed else f"FAIL: {row.reason}"
    case = row.case
    run, simulated = (case.specimen, case.scale, case.preset), _number(row.simulated, form)
    return (*run, label, simulated, experiment, deviation, row.kind, row.rule, verdict)


def _drift_lines(outcome: Outcome) -> Iterator[str]:
    if outcome.updated:
        yield f"baseline {outcome.baseline}: {len(outcome.updated)} runs written"
        yield from (f"  {text}" for text in outcome.updated)
    yield from (f"  {name}: removed, no level runs it any more" for name in outcome.dropped)
    for scale, limits in LIMITS.items():
        mine = [drift for drift in outcome.drifts if drift.case.scale == scale]
        if mine:
            good = sum(drift.passed for drift in mine)
            changes = [c for drift in mine for c in drift.changes if c.counted is None]  # crests have no shares
            worst = max(changes, key=lambda c: abs(c.change) if math.isfinite(c.change) else math.inf, default=None)
            largest = f"; largest change {100.0 * abs(worst.change):.2g} %, {worst.what}" if worst else ""
            yield f"drift from the baseline, {scale}: {good} of {len(mine)} runs pass{largest}"
            number, curve = 100.0 * limits.number, 100.0 * limits.curve
            yield f"  limits: {number:g} % of a number, {curve:g} % of the largest value of a curve"
            yield from _wider_limit_lines(mine)
            yield from (f"  FAIL {drift.case.name}: {reason}" for drift in mine for reason in drift.reasons)
    if any(drift.entry is not None and drift.entry.cpu != cpu_model() for drift in outcome.drifts):
        yield "  another processor model, which rounds differently, wrote some entries of the baseline"
    yield from (f"FAIL {name}: {LOST}" for name in outcome.lost)


def _wider_limit_lines(drifts: list[Drift]) -> Iterator[str]:
    for drift in drifts:
        if drift.entry is None:
            continue
        if limits := own_limits(drift.case, drift.entry):
            number, curve, buckled = (100.0 * v for v in astuple(limits))
            yield f"  {drift.case.name}, which amplifies rounding: {number:g} %, {curve:g} %, buckles {buckled:g} %"
        elif drift.entry.runs > 1 and drift.changes:
            along = limits_of(drift.case, drift.entry)
            widest = max({*along} - {*drift.entry.ranges}, key=lambda name: along[name])
            scatter = f"plus {SCATTER_FACTOR:g} times the scatter of {drift.entry.runs} runs rounded differently"
            most = f"{100.0 * along[widest]:.2g} % ({widest})"
            yield f"  {drift.case.name}: {scatter}, in all at most {most}; one crest more or fewer"


def _number(value: float, form: str) -> str:
    return form.format(value) if math.isfinite(value) else "-"


def _lines(rows: list[tuple[str, ...]], right: tuple[int, ...]) -> list[str]:
    return [line for row in table(rows, width_of(sys.stdout), right) for line in row]


#: characters that XML 1.0 does not allow
FORBIDDEN_CHARACTERS = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def write_junit(path: Path, outcome: Outcome) -> None:
    """Write ``outcome`` to ``path``; raises :class:`ResourceError`."""
    root = ET.Element("testsuites", name="knittest regress")
    rows = [
        _testcase(
            f"table3.{row.case.test}.{row.case.scale}", f"{row.case.specimen} {row.quantity} ({row.kind})", 0.0,
            row.reason, f"{row.simulated:.6g} simulated, {row.mean:g} ± {row.sd:g} measured; {row.rule}",
        )
        for row in outcome.rows
    ]  # fmt: skip
    drifts = [
        _testcase(
            f"drift.{drift.case.test}.{drift.case.scale}", drift.case.name, outcome.records[drift.case].seconds,
            "".join(drift.reasons[:1]), "\n".join(drift.reasons), drift.is_blocked,
        )
        for drift in outcome.drifts
    ]  # fmt: skip
    drifts += [_testcase("drift.lost", name, 0.0, LOST, LOST) for name in outcome.lost]
    for name, cases in (("table 3", rows), ("drift", drifts)):
        failed, errors = (sum(case.find(what) is not None for case in cases) for what in ("failure", "error"))
        time = sum(float(case.get("time", "0")) for case in cases)
        suite = ET.SubElement(
            root, "testsuite", name=name, tests=str(len(cases)), failures=str(failed), errors=str(errors),
            skipped="0", time=f"{time:.3f}",
        )  # fmt: skip
        suite.extend(cases)
    ET.indent(root)
    write_atomic(path, ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def _testcase(where: str, name: str, seconds: float, message: str, text: str, no_room: bool = False) -> ET.Element:
    """Test case, which failed if there is a ``message``."""
    case = ET.Element("testcase", classname=where, name=name, time=f"{seconds:.3f}")
    if message:
        tag, kind = ("error", "ResourceError") if no_room else ("failure", "OutOfTolerance")
        failure = ET.SubElement(case, tag, message=FORBIDDEN_CHARACTERS.sub("?", message), type=kind)
        failure.text = FORBIDDEN_CHARACTERS.sub("?", text)
    return case
