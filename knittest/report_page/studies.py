"""Knowledge of a test beside the run: what half its speed does, and the friction that nobody published."""

import math

import numpy as np

from knittest.base.result_rows import LABELS
from knittest.experiment.simulated_studies import SpeedRow, friction_curves, speed_rows
from knittest.laboratory.halving import LIMIT, change
from knittest.laboratory.picture_frame.config import PictureFrameRun
from knittest.laboratory.picture_frame.test import fabric_side
from knittest.materials.trellis import crosshead_of_normalised
from knittest.report_page.blocks import Block, Cell, Section, Table, Text
from knittest.report_page.loading import LoadedRun

#: shear angles of the table [deg]
ANGLES = (10.0, 20.0, 30.0, 40.0)
NOT_STUDIED = (
    "What speed does to this test was not studied with this fabric. Repeat the run with --verify, or study it: "
    "knittest check {} --convergence with the fabric {} and the settings of this run."
)
SPEED_HEAD = ("result", "as set", "at half", "change")


def studies(run: LoadedRun) -> list[Section]:
    """One section; of a fabric or test that was not studied it says how to do so, of what is not known nothing."""
    blocks: list[Block] = [*_friction(run), *_speed(run)]
    if not blocks and run.run is not None:
        blocks.append(Text(NOT_STUDIED.format(run.rig, run.run.fabric.name)))
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


def _friction(run: LoadedRun) -> list[Block]:
    """Force of the frame by yarn-yarn friction, scaled to the frame of the run, above that of the run itself."""
    given = run.run
    if not isinstance(given, PictureFrameRun) or given.model.scale != "meso":
        return []
    curves = friction_curves(given.fabric.name)
    if not curves:
        return []
    rig, used = given.rig, given.fabric.contact.friction_coefficient
    sides = fabric_side(given), rig.frame_side or rig.side
    rows = []
    for curve in curves:
        force = np.interp(ANGLES, curve.angle, curve.force, right=np.nan)
        newton = crosshead_of_normalised(force, np.deg2rad(ANGLES), *sides)
        rows.append((Cell(f"sweep, {curve.coefficient:g}"), *(_number(float(f), "{:.2f}") for f in newton)))
    own = run.summary.results.get("shear_force_n_at_deg")
    if isinstance(own, dict):
        values = [own.get(f"{angle:g}") for angle in ANGLES]
        numbers = [_number(v, "{:.2f}") if isinstance(v, float) else Cell("-") for v in values]
        rows.append((Cell(f"this run, {used.value:g} ({used.source})"), *numbers))
    head = ("yarn-yarn friction coefficient", *(f"{angle:g} deg" for angle in ANGLES))
    caption = "Force of the crosshead [N] by yarn-yarn friction: a shipped sweep, scaled to the size of this frame"
    return [
        Table(caption, head, rows, (1, 2, 3, 4)),
        Text("The coefficient is not published. The sweep was simulated; knittest batch repeats it."),
    ]
