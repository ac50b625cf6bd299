"""Shells beyond the last angle of their shear law, or beyond their table of two strains: the laws are extrapolated."""

from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from pydantic import ValidationError

from knittest.base.errors import InputError
from knittest.base.history import Array, History
from knittest.base.kinds import kinds
from knittest.config.run import Run
from knittest.laboratory.base import biaxial_table, shear_curve
from knittest.laboratory.strips import shell_angles
from knittest.materials.shear import last_angle

#: angle [deg] beyond the end of the law from which on it counts: a frame that ends there scatters about it
MARGIN = 1.0


@dataclass(frozen=True)
class LawExcess:
    """``share`` of the area [-] sheared beyond ``end`` [deg], up to ``largest``; ``needed`` leaves 5 % of the area."""

    share: float = 0.0
    end: float = np.inf
    largest: float = 0.0
    needed: float = 0.0

    @property
    def stated(self) -> str:
        """Text of a warning."""
        return (
            f"{100.0 * self.share:.1f} % of the fabric is sheared beyond the end of its shear law, {self.end:.1f} deg, "
            f"up to {self.largest:.0f} deg; there the law is extrapolated by its last tangent"
        )

    def advice(self, run: Run) -> str:
        """Change after which less of the fabric is beyond the law."""
        if field := kinds()[run.rig.kind].sheared_to:
            return (
                f"end the test with the law by --set {field}={_largest_known_angle(self.end):g}, or extend macro.shear"
            )
        return f"extend the shear law (fabric.macro.shear) to {ceil(self.needed):d} deg"


@dataclass(frozen=True)
class TableExcess:
    """``share`` of the area [-] beyond the highest strains of ``macro.biaxial``, up to ``largest`` [%] (warp, weft)."""

    share: float
    largest: tuple[float, float]

    @property
    def stated(self) -> str:
        """Text of a warning."""
        return (
            f"{100.0 * self.share:.1f} % of the fabric is strained beyond the table of macro.biaxial, up to "
            f"{self.largest[0]:.3g} % (warp) and {self.largest[1]:.3g} % (weft); there the law continues with the "
            "largest tangents of the table"
        )

    def advice(self, run: Run) -> str:
        """Change after which less of the fabric is beyond the table."""
        return f"extend fabric.macro.biaxial to {self.largest[0]:.3g} % (warp) and {self.largest[1]:.3g} % (weft)"


def find_law_excess(run: Run, history: History, to_failure: bool) -> LawExcess | TableExcess:
    """Find the worst frame, of a test ``to_failure`` up to its largest force; 0 of a meso model."""
    if run.model.scale != "macro" or history.mesh.kind != "shells":
        return LawExcess()
    last = float(history.curve["time_ms"][int(np.argmax(history.curve["force_n"]))]) if to_failure else np.inf
    end = last_angle(run.fabric, shear_curve(run))
    area = shell_areas(history.frames[0].position[history.mesh.cells])
    frames = [frame for frame in history.frames if frame.time <= last and "shear_angle" in frame.fields]
    found: list[LawExcess | TableExcess] = [LawExcess(end=end)]
    for frame in frames:
        alive = area * (frame.fields["alive"] > 0.0)
        found.append(law_excess(np.rad2deg(np.abs(shell_angles(frame))), alive, end))
    if (table := biaxial_table(run.fabric)) is not None:
        for frame in frames:
            warp, weft = frame.fields["strain_warp"], frame.fields["strain_weft"]
            alive = area * (frame.fields["alive"] > 0.0)
            share = float(alive[table.is_beyond(warp, weft)].sum()) / max(float(alive.sum()), 1e-300)
            found.append(TableExcess(share, (100.0 * float(warp.max()), 100.0 * float(weft.max()))))
    return max(found, key=lambda one: one.share)


def end_with_shear_law(run: Run) -> tuple[Run, str]:
    """``run`` of a macro model ended with its shear law, and a sentence on it; unchanged, and empty, where stated."""
    field = kinds()[run.rig.kind].sheared_to.removeprefix("rig.")
    if run.model.scale != "macro" or not field or field in run.rig.model_fields_set or run.fabric.macro.shear is None:
        return run, ""
    end, usual = last_angle(run.fabric, shear_curve(run)), getattr(run.rig, field)
    if end >= usual:
        return run, ""
    try:
        rig = type(run.rig).model_validate(run.rig.model_dump(exclude_unset=True) | {field: _largest_known_angle(end)})
    except ValidationError:  # such as turns beyond the law: the test says what is wrong
        return run, ""
    law = "the derived shear law" if run.fabric.macro.shear.source == "derived" else "macro.shear"
    return run.model_copy(update={"rig": rig}), (
        f"rig.{field} = {_largest_known_angle(end):g} deg instead of the default {usual:g} deg, because {law} "
        f"ends there"
    )


def _largest_known_angle(end: float) -> float:
    """Largest angle [deg] to a tenth that a law up to ``end`` [deg] knows."""
    return floor(10.0 * end) / 10.0


def check_law_range(run: Run, largest: float) -> None:
    """Raise :class:`InputError` where the rig shears the shells to ``largest`` [deg], beyond their law."""
    end = last_angle(run.fabric, shear_curve(run))
    if largest > end:
        raise InputError(
            f"rig.max_angle = {largest:g} deg: the fabric's shear law (macro.shear) ends at {end:g} deg; "
            f"end the test there with --set rig.max_angle={_largest_known_angle(end):g}, or extend the law"
        )


def law_excess(angle: Array, area: Array, end: float) -> LawExcess:
    """Share of shells with ``area`` and ``angle`` [deg], (n,) each, beyond a law that ends at ``end`` [deg]."""
    whole = float(area.sum())
    if not whole > 0.0:
        return LawExcess(end=end)
    share = float(area[angle > end + MARGIN].sum()) / whole
    order = np.argsort(angle)
    held = np.cumsum(area[order]) / whole
    needed = float(angle[order][int(np.searchsorted(held, 0.95))])
    return LawExcess(share, end, float(angle.max()), needed)


def shell_areas(corners: Array) -> Array:
    """Area [mm2] of shells with ``corners`` (n, 4, 3) [mm], (n,)."""
    diagonals = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    return np.asarray(0.5 * np.linalg.norm(np.cross(*diagonals), axis=1))
