"""The study as rows, as CSV and as Markdown."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from knittest import __version__
from knittest.base.result_rows import LABELS
from knittest.laboratory.halving import LIMIT, Halving, change, diagnostic

COLUMNS = (
    "test", "scale", "variant", "direction", "preset", "setting", "unit", "value", "quantity", "result", "result_half",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One result at ``study``'s setting and at half of it, NaN where a run gave none."""

    study: Halving
    quantity: str
    result: float
    half: float

    @property
    def change(self) -> float:
        """Share by which the result at half the setting differs."""
        return change(self.result, self.half)

    @property
    def within(self) -> bool | None:
        """Tell whether it holds within :data:`LIMIT`; None where there is nothing to compare."""
        return None if math.isnan(self.change) else abs(self.change) < LIMIT


def rows_of(study: Halving, fast: Mapping[str, float], slow: Mapping[str, float]) -> Iterator[Row]:
    """One row a result that a user would report."""
    for quantity, result in fast.items():
        if quantity not in diagnostic():
            yield Row(study, quantity, _number(result), _number(slow.get(quantity)))


def csv_text(rows: Iterable[Row], variant: str) -> str:
    """The table as CSV, with what it is in its head."""
    lines = [
        "# kind: simulated",
        f"# source: knittest speed-study, variant {variant}, version {__version__}; the halved setting in its unit",
        ",".join(COLUMNS),
    ]
    for row in rows:
        run = row.study.run
        cells = (
            run.rig.kind, run.model.scale, variant, run.direction, run.model.preset, row.study.setting, row.study.unit,
            f"{row.study.value:g}", row.quantity, f"{row.result:.6g}", f"{row.half:.6g}",
        )  # fmt: skip
        lines.append(",".join(cells))
    return "\n".join(lines) + "\n"


def markdown(rows: Sequence[Row]) -> list[str]:
    """Lines of the table; a change above :data:`LIMIT` is in bold."""
    lines = ["| test | scale | halved | result | as set | at half | change |", "|---|---|---|---|---|---|---|"]
    for row in rows:
        study = row.study
        unit = "" if study.unit == "-" else f" {study.unit}"
        halved = f"{study.setting} {study.value:g}{unit}"
        label, form = LABELS.get(row.quantity, (row.quantity.replace("_", " "), "{:.4g}"))
        result, half = (form.format(v) if math.isfinite(v) else "-" for v in (row.result, row.half))
        said = "-" if row.within is None else f"{100.0 * row.change:+.2f} %" if row.within else _bold(row.change)
        lines.append(
            f"| {study.run.rig.kind} | {study.run.model.scale} | {halved} | {label} | {result} | {half} | {said} |"
        )
    return lines


def _bold(share: float) -> str:
    return f"**{100.0 * share:+.1f} %**" if math.isfinite(share) else "**from 0**"


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)
