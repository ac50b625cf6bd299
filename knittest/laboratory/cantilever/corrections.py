"""Results of a cantilever with its chord in the plane, and after the last of its drift."""

from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.numerical_error import Corrections, Numbers
from knittest.materials.heavy_elastica import overhang_ratio

#: chord angles [deg] between which the heavy elastica converts overhangs
FLATTEST, STEEPEST = 1.0, 85.0
#: bending stiffness per width [N mm] by Eq. 2, B = w (L / 2)^3
EQ2 = "bending_stiffness_eq2_n_mm_per_width"


class CantileverCorrections(Corrections[CantileverRun]):
    """See :class:`knittest.laboratory.numerical_error.Corrections`."""

    def exact(self, run: CantileverRun, results: Numbers) -> Numbers:
        """Convert overhang and stiffness by Eq. 2 to a chord in the plane, which a search meets within a tolerance."""
        found = dict(results)
        angle = found.get("chord_angle_deg")
        if run.rig.mode != "overhang" or angle is None or not FLATTEST <= angle <= STEEPEST:
            return found
        ratio = overhang_ratio(run.rig.plane_angle, angle)
        for name, power in (("overhang_mm", 1), (EQ2, 3)):
            value = found.get(name)
            found[name] = value if value is None else value * ratio**power
        return found

    def correct_to_equilibrium(self, run: CantileverRun, results: Numbers) -> Numbers:
        """Move the chord of a strip of yarns by its last drift, and correct it as :meth:`exact`."""
        found = dict(results)
        angle, drift, stiffness = (found.get(n) for n in ("chord_angle_deg", "drift_deg", EQ2))
        if angle is not None and drift is not None:
            moved = found["chord_angle_deg"] = angle + abs(drift)
            if run.rig.mode == "angle" and stiffness is not None and FLATTEST <= angle <= moved <= STEEPEST:
                found[EQ2] = stiffness * overhang_ratio(angle, moved) ** 3
        return self.exact(run, found)
