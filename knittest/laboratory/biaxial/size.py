"""Size of the square in a run."""

from knittest.laboratory.biaxial.config import BiaxialRun


def stated(run: BiaxialRun) -> tuple[str, ...]:
    """Size of the square and the ratio of its strains, in words."""
    rig = run.rig
    return (f"square of {rig.side:g} mm, the other strain {rig.ratio:g} times that of the {rig.direction}",)


def sheet(run: BiaxialRun) -> tuple[float, float]:
    """Length and width [mm] of the sheet of shells."""
    return run.rig.side, run.rig.side
