"""Size of the strip in a run."""

from knittest.laboratory.tensile.config import TensileRun


def stated(run: TensileRun) -> tuple[str, ...]:
    """Size of the strip and what acts on it, in words."""
    rig = run.rig
    return (f"strip {rig.width:g} mm wide, {rig.gauge_length:g} mm between the clamps",)


def sheet(run: TensileRun) -> tuple[float, float]:
    """Length and width [mm] of the sheet of shells."""
    return run.rig.gauge_length, run.rig.width
