"""Size of the strip in a run."""

from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.cantilever.test import given_overhang


def stated(run: CantileverRun) -> tuple[str, ...]:
    """Size of the strip and what acts on it, in words."""
    return (f"strip {run.rig.width:g} mm wide",)


def sheet(run: CantileverRun) -> tuple[float, float]:
    """Length and width [mm] of the sheet of shells."""
    return given_overhang(run), run.rig.width
