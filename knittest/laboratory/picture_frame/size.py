"""Size of the square in a run."""

from knittest.laboratory.picture_frame.config import PictureFrameRun


def stated(run: PictureFrameRun) -> tuple[str, ...]:
    """Size of the square and what acts on it, in words."""
    rig = run.rig
    return (f"square of {rig.side:g} mm in a frame of {rig.frame_side or rig.side:g} mm",)


def sheet(run: PictureFrameRun) -> tuple[float, float]:
    """Length and width [mm] of the sheet of shells."""
    return run.rig.side, run.rig.side
