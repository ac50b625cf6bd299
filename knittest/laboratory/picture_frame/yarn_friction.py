"""Force of a frame of yarns by the friction of yarn on yarn, which nobody published, above that of a run."""

from collections.abc import Mapping

import numpy as np

from knittest.experiment.simulated_studies import friction_curves
from knittest.laboratory.picture_frame.config import PictureFrameRun
from knittest.laboratory.picture_frame.test import fabric_side
from knittest.laboratory.study import Study
from knittest.materials.trellis import crosshead_of_normalised

#: shear angles of the table [deg]
ANGLES = (10.0, 20.0, 30.0, 40.0)


def study(run: PictureFrameRun, results: Mapping[str, object]) -> Study | None:
    """The shipped sweep, scaled to the frame of ``run``, and what ``run`` itself found; none of shells."""
    curves = friction_curves(run.fabric.name) if run.model.scale == "meso" else []
    if not curves:
        return None
    used, sides = run.fabric.contact.friction_coefficient, (fabric_side(run), run.rig.frame_side or run.rig.side)
    rows: list[tuple[str, tuple[float, ...]]] = []
    for curve in curves:
        force = np.interp(ANGLES, curve.angle, curve.force, right=np.nan)
        newton = crosshead_of_normalised(force, np.deg2rad(ANGLES), *sides)
        rows.append((f"sweep, {curve.coefficient:g}", tuple(float(f) for f in newton)))
    own = results.get("shear_force_n_at_deg")
    if isinstance(own, dict):
        values = (own.get(f"{angle:g}") for angle in ANGLES)
        numbers = tuple(v if isinstance(v, float) else np.nan for v in values)
        rows.append((f"this run, {used.value:g} ({used.source})", numbers))
    return Study(
        "Force of the crosshead [N] by yarn-yarn friction: a shipped sweep, scaled to the size of this frame",
        ("yarn-yarn friction coefficient", *(f"{angle:g} deg" for angle in ANGLES)),
        tuple(rows),
        "The coefficient is not published. The sweep was simulated on squares of 50 mm with the set calibrated; "
        "knittest batch repeats it.",
    )
