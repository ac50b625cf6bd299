"""End of a run: the field that ends it sooner, its motion up to there staying the same."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Ending:
    """``field`` of a run that ends it sooner, and where the run ends now; both in the unit of the field.

    Numbers at a place are means of the motion up to ``near`` beyond it.
    """

    field: str
    now: float
    near: float
