"""Knowledge of a test beside the run: what half its speed does, and what the test itself shows."""

import math

from knittest.base.kinds import kinds
from knittest.base.result_rows import LABELS
from knittest.experiment.simulated_studies import SpeedRow, shear_bands, speed_rows
from knittest.laboratory.halving import LIMIT, change
from knittest.laboratory.study import Study
from knittest.report_page.blocks import Block, Cell, Section, Table, Text
from knittest.report_page.loading import LoadedRun

NOT_STUDIED = (
    "What speed does to this test was not studied with this fabric. Repeat the run with --verify, or study it: "
    "knittest check {} --convergence with the fabric {} and the settings of this run."
)
SPEED_HEAD = ("result", "as set", "at half", "change")
SHEAR_HEAD = ("shear angle", "5 %", "50 %", "95 %", "points that ran")
SHEAR_NOTE = (
    "Bending, set, tension, friction and patches of these yarns are assumed: forces of shear, of the stamp too, are "
    "known no better than this band. knittest uncertainty configs/uncertainty/shear-order.yaml repeats it."
)


def studies(run: LoadedRun) -> list[Section]:
    """One section; of a fabric or test that was not studied it says how to do so, of what is not known nothing."""
    blocks: list[Block] = [*_own(run), *_speed(run)]
    if not blocks and run.run is not None:
        blocks.append(Text(NOT_STUDIED.format(run.rig, run.run.fabric.name)))
    blocks += _shear(run)
    return [Section(f"run-{run.number}-studies", "Studies of the model", blocks)] if blocks else []


def _speed(run: LoadedRun) -> list[Block]:
    scale, fabric = str(run.setting("model", "scale") or run.summary.scale), run.setting("fabric", "name")
    rows = speed_rows(run.rig, scale, str(fabric))
    if not rows:
        return []
    first = rows[0]
    unit = "" if first.unit == "-" else f" {first.unit}"
    caption = (
        f"{first.setting} halved from {first.value:g}{unit}: shipped study on variant {first.variant}, preset "
        f"{first.preset}, not this run; knittest speed-study repeats it"
    )
    return [Table(caption, SPEED_HEAD, [_speed_row(row) for row in rows], (1, 2, 3))]


def _shear(run: LoadedRun) -> list[Block]:
    """Bands of the fabric's shear, where the test shears it."""
    kind = kinds().get(run.rig)
    bands = shear_bands(str(run.setting("fabric", "name"))) if kind is not None and kind.shears else []
    if not bands:
        return []
    rows = [
        (
            Cell(f"{band.angle:g} deg", band.angle),
            *(Cell(f"{value:.4f}", value) for value in (band.low, band.middle, band.high)),
            Cell(f"{band.count} of {band.points}"),
        )
        for band in bands
    ]
    caption = "Shear of a cell of yarns [N/mm] over the prior of what nobody measured: shipped study, not this run"
    return [Table(caption, SHEAR_HEAD, rows, (0, 1, 2, 3)), Text(SHEAR_NOTE)]


def _speed_row(row: SpeedRow) -> tuple[Cell, ...]:
    label, form = LABELS.get(row.quantity, (row.quantity.replace("_", " "), "{:.4g}"))
    share = change(row.result, row.half)
    if math.isnan(share):
        told = Cell("-")
    else:
        held = abs(share) < LIMIT
        text = f"{100.0 * share:+.2f} %" if math.isfinite(share) else "from 0"
        told = Cell(text, share, tone="good" if held else "warn", note="" if held else f"above {100.0 * LIMIT:g} %")
    return Cell(label), _number(row.result, form), _number(row.half, form), told


def _number(value: float, form: str) -> Cell:
    return Cell(form.format(value), value) if math.isfinite(value) else Cell("-")


def _own(run: LoadedRun) -> list[Block]:
    """Study that the test itself shows beside the run."""
    kind = kinds().get(run.rig)
    if run.run is None or kind is None or not kind.study:
        return []
    found: Study | None = kind.load("study")(run.run, run.summary.results)
    if found is None:
        return []
    rows = [(Cell(label), *(_number(number, found.form) for number in numbers)) for label, numbers in found.rows]
    return [Table(found.caption, found.head, rows, tuple(range(1, len(found.head)))), Text(found.note)]
