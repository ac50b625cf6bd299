"""Outcome of a homogenisation, as homogenise.json holds it and the command prints it."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field

import knittest
from knittest.config.run import Run
from knittest.export.manifest import now
from knittest.laboratory.cell.config import CellRun
from knittest.studies.homogenise.card import FABRIC, Card, card_numbers
from knittest.studies.homogenise.check import TOLERANCE, Row
from knittest.studies.trials.record import Record, looser_note
from knittest.studies.trials.trial import code_digest

#: said of every card of a cell
ALIKE = "yarns of a cell are all alike: strips of scattered yarns break at less force and strain than this card has"


@dataclass(frozen=True)
class Ended:
    """End of one run: ``scale`` yarns or shells, ``name`` of its test."""

    scale: str
    name: str
    record: Record


@dataclass
class Outcome:
    """Runs that ended, the card and its check; ``failure`` says why there is no card, and is empty where there is."""

    run: Run
    command: str
    ended: list[Ended] = field(default_factory=list)
    card: Card | None = None
    rows: Sequence[Row] = ()
    failure: str = ""

    @property
    def status(self) -> str:
        """Status in words."""
        if self.failure:
            return "no card"
        return "reproduced" if self.within else "not reproduced"

    @property
    def within(self) -> bool:
        """Tell whether shells with the card reproduce the yarns."""
        return not self.failure and bool(self.rows) and all(row.within for row in self.rows)

    @property
    def worst(self) -> Row | None:
        """The row of largest deviation."""
        return max(self.rows, key=lambda row: abs(row.deviation), default=None)


def as_data(outcome: Outcome) -> dict[str, object]:
    """Plain data of homogenise.json."""
    run = outcome.run
    return {
        "command": outcome.command,
        "fabric": run.fabric.name, "parameters": run.parameters, "preset": run.model.preset,
        "seed": run.variability.seed,
        "status": outcome.status, "reason": outcome.failure,
        "card": FABRIC if not outcome.failure else None,
        "numbers": card_numbers(outcome.card) if outcome.card else {},
        "tolerance_pct": TOLERANCE,
        "largest_deviation_pct": abs(outcome.worst.deviation) if outcome.worst else None,
        "check": [asdict(row) | {"within": row.within} for row in outcome.rows],
        "note": _note(run),
        "looser_limits": looser_note(one.record for one in outcome.ended),
        "runs": [_run(one) for one in outcome.ended],
        "version": knittest.__version__, "code": code_digest(), "written": now(),
    }  # fmt: skip


def _run(one: Ended) -> dict[str, object]:
    record = one.record
    return {
        "scale": one.scale, "test": one.name, "trial": record.key, "status": record.status, "reason": record.reason,
        "seconds": record.seconds, "cpu_s": record.cost["cpu_s"] if record.cost else None, "results": record.results,
    }  # fmt: skip


def report_lines(outcome: Outcome) -> list[str]:
    """Lines that the command prints at its end."""
    lines = [f"  {one.name} of {one.scale} {_brief(one.record)}" for one in outcome.ended if _lost(one.record)]
    lines += looser_note(one.record for one in outcome.ended)
    if outcome.failure:
        return [f"no card: {outcome.failure}", *lines]
    width = max(len(f"{row.test}, {row.quantity}") for row in outcome.rows)
    lines.append(f"{'':{width}}  {'yarns':>10}  {'shells':>10}  deviation")
    for row in outcome.rows:
        name, mark = f"{row.test}, {row.quantity}", "" if row.within else f"  more than {TOLERANCE:g} %"
        lines.append(
            f"{name:{width}}  {row.yarns:>10.5g}  {row.shells:>10.5g}  {row.deviation:>+7.2f} %  {row.unit}{mark}"
        )
    lines += [note] if (note := _note(outcome.run)) else []
    worst = outcome.worst
    if worst:
        lines.append(
            f"{outcome.status} within {TOLERANCE:g} %: largest deviation {worst.deviation:+.2f} %, {worst.test}, "
            f"{worst.quantity}"
        )
    return lines


def _note(run: Run) -> str:
    """Sentence on what a card of a cell overstates; of other cards empty."""
    return ALIKE if isinstance(run, CellRun) else ""


def _lost(record: Record) -> bool:
    return record.status != "completed"


def _brief(record: Record) -> str:
    return f"{record.status}: {record.reason}"
