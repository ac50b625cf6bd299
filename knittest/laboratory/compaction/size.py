"""Size of the plates in a run."""

from knittest.laboratory.compaction.config import CompactionRun


def stated(run: CompactionRun) -> tuple[str, ...]:
    """Size of the plates and the pressure that ends the test, in words."""
    return f"plates of {run.rig.side:g} mm", f"pressed with {run.rig.max_pressure:g} kPa"
