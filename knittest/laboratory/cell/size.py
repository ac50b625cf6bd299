"""Size of a cell in a run."""

from knittest.laboratory.cell.config import CellRun


def stated(run: CellRun) -> tuple[str, ...]:
    """Repeats and path, in words."""
    return (f"{run.rig.wales} x {run.rig.courses} repeats without an edge, path {run.rig.path}",)
