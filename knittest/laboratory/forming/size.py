"""Size of the blank in a run."""

from knittest.laboratory.forming.config import FormingRun


def stated(run: FormingRun) -> tuple[str, ...]:
    """Size of the blank and what acts on it, in words."""
    rig = run.rig
    held = f"holder {rig.blank_holder_force:g} N" if rig.blank_holder_force > 0.0 else "no holder"
    return f"blank {rig.blank_width:g} x {rig.blank_length:g} mm", f"stamp {rig.stamp.kind}, {rig.depth:g} mm", held


def sheet(run: FormingRun) -> tuple[float, float]:
    """Length and width [mm] of the sheet of shells."""
    return run.rig.blank_length, run.rig.blank_width
