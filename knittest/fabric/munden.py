"""Constants of a plain knit by Munden (1959), J. Text. Inst. 50, T448: densities times the length of a loop.

The knit relaxes towards values that hold for any yarn and length; beside them it is seen whether that of a fabric with
inlays is stretched.
"""

from typing import NamedTuple

from knittest.base.rest import RELAXED
from knittest.fabric.cell import CellSpec

#: stitches an area times the square of the loop length of a relaxed plain knit [-], 19 to 21.6
STITCHES = 20.0


class Munden(NamedTuple):
    """Courses and wales a length, and stitches an area, times the loop length or its square [-]."""

    courses: float
    wales: float
    stitches: float

    @classmethod
    def of(cls, spec: CellSpec, draw_in: float = 0.0) -> "Munden":
        """Constants of a cell whose loops are shorter by ``draw_in`` [-] than its loop length."""
        length = (1.0 - draw_in) * spec.loop_length
        courses, wales = length / spec.course, length / spec.wale
        return cls(courses, wales, courses * wales)

    def __str__(self) -> str:
        (low, high), (least, most) = RELAXED.values()
        return (
            f"{self.courses:.2f}, {self.stitches:.1f} (relaxed plain knits {low:g} to {high:g}, {least:g} to {most:g})"
        )
