"""Size of the strip in a run."""

from knittest.laboratory.friction.config import FrictionRun


def stated(run: FrictionRun) -> tuple[str, ...]:
    """Size of the strip and what acts on it, in words."""
    rig = run.rig
    plate = f"plates {rig.plate_length:g} x {rig.plate_width:g} mm"
    return f"strip {rig.length:g} x {rig.width:g} mm", plate, f"pressed by {rig.normal_force:g} N"


def sheet(run: FrictionRun) -> tuple[float, float]:
    """Length and width [mm] of the sheet of shells."""
    return run.rig.length, run.rig.width
