"""Constants of a plain knit by Munden (1959), J. Text. Inst. 50, T448: densities times the length of a loop.

The knit relaxes towards values that hold for any yarn and length; beside them it is seen whether that of a fabric with
inlays is stretched.
"""

from typing import NamedTuple

from knittest.fabric.cell import CellSpec

#: of relaxed plain knits (textbook values, apparel): K_c and K_s
RELAXED_COURSES, RELAXED_STITCHES = (5.0, 5.3), (19.0, 21.6)


class Munden(NamedTuple):
    """Courses and wales a length, and stitches an area, times the loop length or its square [-]."""

    courses: float
    wales: float
    stitches: float

    @classmethod
    def of(cls, spec: CellSpec) -> "Munden":
        """Constants of a cell."""
        courses, wales = spec.loop_length / spec.course, spec.loop_length / spec.wale
        return cls(courses, wales, courses * wales)

    def __str__(self) -> str:
        low, high = RELAXED_COURSES
        least, most = RELAXED_STITCHES
        return (
            f"{self.courses:.2f}, {self.stitches:.1f} (relaxed plain knits {low:g} to {high:g}, {least:g} to {most:g})"
        )
