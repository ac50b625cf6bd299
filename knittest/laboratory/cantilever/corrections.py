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
        """Correct an overhang that was searched for the difference of its chord from the plane."""
        return at_the_plane(run, results)

    def rested(self, run: CantileverRun, results: Numbers) -> Numbers:
        """Correct a strip of yarns for its last drift."""
        return after_drift(run, results)


def at_the_plane(run: CantileverRun, results: Numbers) -> Numbers:
    """Overhang and stiffness by Eq. 2 with the chord in the plane, by the heavy elastica; unchanged for a given
    overhang.

    The search ends within a tolerance, so two runs may share an overhang though their chords differ.
    """
    found = dict(results)
    angle = found.get("chord_angle_deg")
    if run.rig.mode != "overhang" or angle is None or not FLATTEST <= angle <= STEEPEST:
        return found
    ratio = overhang_ratio(run.rig.plane_angle, angle)
    for name, power in (("overhang_mm", 1), (EQ2, 3)):
        value = found.get(name)
        found[name] = value if value is None else value * ratio**power
    return found


def after_drift(run: CantileverRun, results: Numbers) -> Numbers:
    """:func:`at_the_plane` of ``results`` with the chord moved by its last drift, which the criterion of rest leaves
    open.
    """
    found = dict(results)
    angle, drift, stiffness = (found.get(n) for n in ("chord_angle_deg", "drift_deg", EQ2))
    if angle is None or drift is None:
        return at_the_plane(run, found)
    moved = found["chord_angle_deg"] = angle + abs(drift)
    if run.rig.mode == "angle" and stiffness is not None and FLATTEST <= angle <= moved <= STEEPEST:
        found[EQ2] = stiffness * overhang_ratio(angle, moved) ** 3
    return at_the_plane(run, found)
