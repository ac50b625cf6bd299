"""The numerical error of every result: what half the speed and another mesh changed."""

import math

from knittest.base.result_rows import LABELS, error_text
from knittest.laboratory.error_notes import error_notes
from knittest.report_page.blocks import Block, Cell, Table, Text
from knittest.report_page.files import Number
from knittest.report_page.loading import LoadedRun

HEADER = ("quantity", "at half the speed", "on the other mesh", "numerical error")


def error_blocks(run: LoadedRun) -> list[Block]:
    """Table of the changes and errors, or that there are none, then how they were found; of a refused run nothing."""
    summary = run.summary
    notes = error_notes(summary.plain(), asked=run.setting("output", "verify") is True)
    texts = [Text(note[0].upper() + note[1:] + ".") for note in notes]
    if not summary.numerical_error or summary.refused:
        return list(texts)
    rows = []
    for quantity, found in summary.numerical_error.items():
        label, form = LABELS.get(quantity, (quantity.replace("_", " "), "{:.4g}"))
        mesh = found.get("finer_mesh_pct", found.get("coarser_mesh_pct"))
        error = _number(found.get("error"))
        told = Cell("not available", note=str(found.get("reason") or ""), tone="warn")
        told = told if error is None else Cell(f"± {error_text(error, form)}", error)
        rows.append((Cell(label), _change(found.get("half_speed_pct")), _change(mesh), told))
    caption = "Numerical error: index of Roache with a safety factor of 3, from half the speed and another mesh"
    return [Table(caption, HEADER, rows, (1, 2, 3)), *texts]


def _change(percent: Number | str) -> Cell:
    value = _number(percent)
    return Cell("-") if value is None else Cell(f"{value:+.2f} %", value)


def _number(value: Number | str) -> float | None:
    return float(value) if isinstance(value, int | float) and math.isfinite(value) else None
