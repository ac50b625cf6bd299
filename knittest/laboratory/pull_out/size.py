"""Size of the piece in a run."""

from knittest.laboratory.pull_out.config import PullOutRun


def stated(run: PullOutRun) -> tuple[str, ...]:
    """Size of the piece, where it is clamped and how far the inlay is pulled, in words."""
    rig = run.rig
    where = "both sides" if rig.clamped == "sides" else "its far end"
    return f"piece {rig.length:g} x {rig.width:g} mm", f"clamped at {where}", f"inlay pulled by {rig.travel:g} mm"
