"""Shear law of the macro model from the force of a picture frame of yarns."""

import json
from pathlib import Path

import numpy as np

from knittest.base.errors import InputError
from knittest.base.files import make_folder, replace_file
from knittest.base.history import Array
from knittest.config.base import Quantity
from knittest.config.fabric import Fabric
from knittest.config.loading import resolve
from knittest.experiment.curves import START
from knittest.laboratory.picture_frame.config import PictureFrameRun
from knittest.materials.trellis import ANGLE, to_conjugate

#: width of the steps over which the frame's force is averaged [deg]
STEP = 2.5
#: share of its width that a step must reach
WHOLE = 0.9
FRAME_ANGLE, NORMALISED = "frame_shear_angle_deg", "normalised_shear_force_n_per_mm"


def homogenised_law(angle: Array, normalised: Array, start: float = START) -> tuple[Array, Array]:
    """Angles [deg] and conjugate force S [N/mm], (n,), from a frame's angle [deg] and normalised force [N/mm].

    Means over whole steps of :data:`STEP` of the first loading, from ``start`` [deg] on, made not to fall; S dgamma is
    work.
    """
    from scipy.optimize import isotonic_regression

    first = slice(0, int(np.argmax(angle)) + 1)
    angle, force = angle[first], to_conjugate(normalised[first], np.deg2rad(angle[first]), "normalised")
    number = np.floor(angle / STEP).astype(int)
    whole = angle.max() - WHOLE * STEP
    used = [k for k in np.unique(number) if start <= k * STEP <= whole and np.count_nonzero(number == k) > 1]
    middle = np.array([angle[number == k].mean() for k in used])
    mean = np.array([force[number == k].mean() for k in used])
    level = isotonic_regression(np.maximum(mean, 0.0)).x
    rises = level > 0.0  # slack loops begin without force: the law rises from 0 to the first one
    return np.concatenate([[0.0], middle[rises]]), np.concatenate([[0.0], level[rises]])


def write_law(run: Path, out: Path) -> tuple[Array, Array]:
    """Write the law of a finished meso picture frame to ``out``; raises :class:`InputError` for another ``run``."""
    import pandas as pd

    path = run / "curve.csv"
    if not path.is_file():
        raise InputError(f"{run}: no curve.csv; expected the folder of a finished picture-frame run")
    given = resolve(config=run / "config.yaml")
    if not isinstance(given, PictureFrameRun) or given.model.scale != "meso":
        raise InputError(
            f"{run}: {given.rig.kind}, {given.model.scale}; expected a picture frame of yarns (picture-frame, meso)"
        )
    summary = run / "summary.json"
    if not summary.is_file():
        raise InputError(f"{run}: no summary.json; expected a finished run: continue with knittest resume {run}")
    if failures := json.loads(summary.read_text(encoding="utf-8"))["refused"]:
        raise InputError(
            f"{run}: quality checks failed ({'; '.join(failures)}), so its force is no law; change the run as advised, "
            "or end it before that angle (--set rig.max_angle=)"
        )
    curve = pd.read_csv(path, comment="#")
    missing = [c for c in (FRAME_ANGLE, NORMALISED) if c not in curve]
    if missing:
        raise InputError(f"{path}: no column {missing[0]}; expected the curve of a picture-frame run")
    angle, force = homogenised_law(curve[FRAME_ANGLE].to_numpy(float), curve[NORMALISED].to_numpy(float))
    if len(angle) < 3:
        least = START + 2 * STEP
        raise InputError(
            f"{path}: the frame was sheared to {curve[FRAME_ANGLE].max():g} deg; expected at least {least:g} deg"
        )
    rig, fabric = given.rig, given.fabric
    head = [
        "kind: simulated",
        f"fabric: {fabric.name}",
        f"source: picture frame of yarns, {fabric.name} ({given.parameters}), {rig.side:g} mm",
        *(f"{name}: {number.value:g} ({number.source})" for name, number in deciding_numbers(fabric).items()),
        f"mean over {STEP:g} deg; conjugate to the shear angle, per reference area",
        f"preset {given.model.preset}, rig.side={rig.side:g}, rig.max_angle={rig.max_angle:g}",
    ]
    rows = "".join(f"{a:.4f},{s:.6f}\n" for a, s in zip(angle, force, strict=True))
    text = "".join(f"# {line}\n" for line in head) + f"{ANGLE},shear_force_n_per_mm\n" + rows
    make_folder(out.parent)
    with replace_file(out) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return angle, force


def deciding_numbers(fabric: Fabric) -> dict[str, Quantity]:
    """Numbers of the yarns that decide the force, as far as the fabric states them."""
    loops, contact = fabric.knitting, fabric.contact
    stated = {
        "yarn-yarn friction coefficient": contact.friction_coefficient,
        "bending stiffness of the loops [N mm2]": loops.bending_stiffness,
        "torsion of the loops over their bending": loops.torsion_ratio,
        "degree of set of the loops": loops.degree_of_set,
        "loop shortening [%]": loops.loop_shortening,
        "tension of the loops [N]": loops.tension,
    }
    if contact.patch and (radius := contact.patch.radius):
        stated |= {
            "patch of a crossing, inlays [mm]": radius.inlay_inlay,
            "patch of a crossing, inlay and loop [mm]": radius.inlay_loop,
            "patch of a crossing, loops [mm]": radius.loop_loop,
        }
    if contact.patch and (compaction := contact.patch.compaction):
        stated |= {
            "lateral modulus of the inlays [MPa]": compaction.reinforcing,
            "lateral modulus of the loops [MPa]": compaction.knitting,
        }
    return {name: number for name, number in stated.items() if number is not None}
