"""Judges whether the speed of a run matters."""

from knittest.base.errors import NumericalError
from knittest.base.kinds import kinds
from knittest.config.run import Run
from knittest.laboratory.halving import changes, halving
from knittest.laboratory.lowered_speed import SPEED, at_result_speed, kept_speed
from knittest.runs.specimen import run_specimen


def speed_study(run: Run) -> tuple[list[str], bool]:
    """All results of ``run`` and of its half speed; whether the first of them holds within its tolerance."""
    fast = run_specimen(run).results
    study = halving(at_result_speed(run, fast))
    slow = run_specimen(study.half).results
    if not kept_speed(study.half, slow):
        raise NumericalError(f"{study.setting} {0.5 * study.value:g}: restarted at a lower speed: no comparison")
    found = changes(fast, slow)
    heads = [f"{value:g} {study.unit}".removesuffix(" -") for value in (study.value, 0.5 * study.value)]
    lines = [f"  {study.setting:<34}{heads[0]:>14}{heads[1]:>14}    change"]
    lines += [f"  {n:<34}{fast[n]:>14.5g}{slow[n]:>14.5g}{100.0 * found[n]:>+9.2f} %" for n in fast if n != SPEED]
    first, limit = next(iter(found)), kinds()[run.rig.kind].converged
    passed = abs(found[first]) < limit
    lines.append(f"  {first}: {'within' if passed else 'NOT within'} {100.0 * limit:g} %")
    return lines, passed
