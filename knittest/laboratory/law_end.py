"""Shells sheared beyond the last angle that their law was measured at, where it goes on with its last tangent."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, floor

import numpy as np
from pydantic import ValidationError

from knittest.base.errors import InputError
from knittest.base.history import Array, Frame, History
from knittest.base.kinds import kinds
from knittest.config.run import Run
from knittest.laboratory.base import shear_curve
from knittest.laboratory.strips import shell_angles
from knittest.materials.shear import last_angle

#: angle [deg] beyond the end of the law from which on it counts: a frame that ends there scatters about it
MARGIN = 1.0


@dataclass(frozen=True)
class BeyondLaw:
    """``share`` of the area [-] sheared beyond ``end`` [deg], by up to ``largest``; ``needed`` [deg] is the angle up to
    which a law would leave 5 % beyond it.
    """

    share: float = 0.0
    end: float = np.inf
    largest: float = 0.0
    needed: float = 0.0

    @property
    def stated(self) -> str:
        """Sentence for a warning."""
        return (
            f"{100.0 * self.share:.1f} % of the fabric is sheared beyond the end of its law, {self.end:.1f} deg, by up "
            f"to {self.largest:.0f} deg: there the law goes on with its last tangent, which nobody measured"
        )

    def advice(self, run: Run) -> str:
        """Change that would bring less of the fabric beyond."""
        if field := kinds()[run.rig.kind].sheared_to:
            return f"{field}={_ending_at(self.end):g} ends where the law does; or give a law that goes on (macro.shear)"
        return f"a law that goes on to {ceil(self.needed):d} deg would pass (fabric.macro.shear)"


def beyond_law(run: Run, history: History, to_failure: bool) -> BeyondLaw:
    """The worst of the frames, of a test ``to_failure`` up to its largest force; nothing for yarns."""
    if run.model.scale != "macro" or history.mesh.kind != "shells":
        return BeyondLaw()
    end = last_angle(run.fabric, shear_curve(run))
    area = shell_areas(history.frames[0].position[history.mesh.cells])
    found = [
        worst_of(np.rad2deg(np.abs(shell_angles(frame))), area * (frame.fields["alive"] > 0.0), end)
        for frame in _judged(history.frames, history, to_failure)
        if "shear_angle" in frame.fields
    ]
    return max(found, key=lambda one: one.share, default=BeyondLaw(end=end))


def ends_with_its_law(run: Run) -> tuple[Run, str]:
    """``run`` of shells, ended where the law of its fabric ends, and a sentence that says so.

    Unchanged, with an empty sentence, where the run states its end or the law goes on.
    """
    field = kinds()[run.rig.kind].sheared_to.removeprefix("rig.")
    if run.model.scale != "macro" or not field or field in run.rig.model_fields_set or run.fabric.macro.shear is None:
        return run, ""
    end, usual = last_angle(run.fabric, shear_curve(run)), getattr(run.rig, field)
    if end >= usual:
        return run, ""
    try:
        rig = type(run.rig).model_validate(run.rig.model_dump(exclude_unset=True) | {field: _ending_at(end)})
    except ValidationError:  # such as turns beyond the law: the test says what is wrong
        return run, ""
    law = "the shear law that the yarns gave" if run.fabric.macro.shear.source == "derived" else "macro.shear"
    return run.model_copy(update={"rig": rig}), (
        f"rig.{field} = {_ending_at(end):g} deg, where {law} ends, instead of the usual {usual:g} deg"
    )


def _ending_at(end: float) -> float:
    """Largest angle [deg] to a tenth that a law up to ``end`` [deg] knows."""
    return floor(10.0 * end) / 10.0


def refuse_beyond_law(run: Run, largest: float) -> None:
    """Raise :class:`InputError` for shells of ``run`` that its rig shears to ``largest`` [deg], beyond their law."""
    end = last_angle(run.fabric, shear_curve(run))
    if largest > end:
        raise InputError(
            f"rig.max_angle = {largest:g} deg: the fabric's shear law (macro.shear) ends at {end:g} deg; "
            f"--set rig.max_angle={_ending_at(end):g} ends the test there, or give a law that goes on"
        )


def worst_of(angle: Array, area: Array, end: float) -> BeyondLaw:
    """Share of shells of ``area`` sheared by ``angle`` [deg], both (n,), under a law that ends at ``end`` [deg]."""
    whole = float(area.sum())
    if not whole > 0.0:
        return BeyondLaw(end=end)
    share = float(area[angle > end + MARGIN].sum()) / whole
    order = np.argsort(angle)
    held = np.cumsum(area[order]) / whole
    needed = float(angle[order][int(np.searchsorted(held, 0.95))])
    return BeyondLaw(share, end, float(angle.max()), needed)


def shell_areas(corners: Array) -> Array:
    """Area [mm2] of shells with ``corners`` (n, 4, 3) [mm], (n,)."""
    diagonals = corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]
    areas: Array = 0.5 * np.linalg.norm(np.cross(*diagonals), axis=1)
    return areas


def _judged(frames: Sequence[Frame], history: History, to_failure: bool) -> list[Frame]:
    if not to_failure:
        return list(frames)
    peak = float(history.curve["time_ms"][int(np.argmax(history.curve["force_n"]))])
    return [frame for frame in frames if frame.time <= peak]
