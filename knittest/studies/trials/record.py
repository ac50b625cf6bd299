"""Record of a trial: its end, results and cost."""

import json
import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Literal, Self

from knittest.base.hiding import host_name
from knittest.base.result_rows import number_of, unfolded
from knittest.base.summary import CostBlock, Summary, Value
from knittest.export.manifest import now

Status = Literal["completed", "refused", "failed", "invalid", "error", "timeout", "crashed", "blocked"]

MEANING: dict[Status, str] = {
    "completed": "ran, and its quality gates passed",
    "refused": "ran, but a quality gate refused its result",
    "failed": "numbers went wrong",
    "invalid": "the input is refused",
    "error": "an error of the program",
    "timeout": "stopped at the time limit",
    "crashed": "its process died",
    "blocked": "disk, memory or a folder in use",
}
#: status of a run that has no record yet
OPEN = "open"
#: the same again if tried again; all others are
SETTLED = ("completed", "refused", "failed", "invalid", "error")


@dataclass(frozen=True)
class Record:
    """Outcome of a trial: ``summary`` is its summary.json, None where it has no result; ``reason`` says why not.

    ``seconds`` is the wall time of the last attempt, ``limit`` its time limit [s], ``earlier`` the reasons why the
    attempts before it came to nothing.
    """

    key: str
    status: Status
    reason: str = ""
    summary: Summary | None = None
    seconds: float = 0.0
    limit: float | None = None
    earlier: tuple[str, ...] = ()
    host: str = field(default_factory=host_name)
    ended: str = field(default_factory=now)

    @property
    def values(self) -> dict[str, Value]:
        """Results of a completed trial; empty for any other."""
        if self.status != "completed" or self.summary is None:
            return {}
        return unfolded(self.summary["results"])

    @property
    def results(self) -> dict[str, float]:
        """Numbers of a completed trial, of an ensemble the means, NaN where JSON has none; empty for any other."""
        found = {name: number_of(value) for name, value in self.values.items()}
        return {name: math.nan if value is None else value for name, value in found.items()}

    @property
    def cost(self) -> CostBlock | None:
        """Cost of a run that has a result."""
        return self.summary.get("cost") if self.summary else None

    @property
    def looser_limits(self) -> list[str]:
        """Limits of its gates that were looser than the preset's, as ``name=value``."""
        return [f"{one['name']}={one['value']}" for one in (self.summary.get("limits", []) if self.summary else [])]

    @property
    def settled(self) -> bool:
        """Tell whether the trial would come to the same if run again."""
        return self.status in SETTLED

    def settled_within(self, limit: float) -> bool:
        """Tell whether it would come to the same with ``limit`` seconds: what timed out may need more."""
        return self.settled or (self.status == "timeout" and limit <= (self.limit or 0.0))

    def to_dict(self) -> dict[str, object]:
        """Record as plain data."""
        return asdict(self) | {"summary": self.summary or {}}

    @classmethod
    def from_dict(cls, data: dict[str, Any]) -> Self:
        """The record of :meth:`to_dict`; raises ``TypeError`` or ``ValueError`` for anything else."""
        if data.get("status") not in MEANING or not isinstance(data.get("summary"), dict):
            raise ValueError("not a record")
        return cls(**{**data, "summary": data["summary"] or None, "earlier": tuple(data["earlier"])})


def record_of(key: str, summary: Summary, seconds: float = 0.0) -> Record:
    """The record of a run that went to its end and left ``summary``."""
    if summary["refused"]:
        return Record(key, "refused", "; ".join(summary["refused"]), summary, seconds)
    return Record(key, "completed", "", summary, seconds)


def looser_note(records: Iterable[Record]) -> list[str]:
    """A line if limits of ``records`` were looser than the preset's, none otherwise."""
    names = dict.fromkeys(name for record in records for name in record.looser_limits)
    return [f"limits looser than the preset's, accepted by --accept-limits: {', '.join(names)}"] if names else []


def recovered(key: str, folder: Path) -> Record | None:
    """The record of a run that completed in ``folder`` although nobody was left to write it down."""
    try:
        manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
        summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
        return record_of(key, summary) if manifest["status"] == "completed" else None
    except (OSError, ValueError, KeyError, TypeError):
        return None
