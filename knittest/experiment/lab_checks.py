"""Slips that a laboratory's files let pass: units, copies, mixed series, specimens that cannot be of one."""

import hashlib
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.config.base import BoundsError, check_bounds, field_meta
from knittest.config.fabric import MacroMaterial
from knittest.experiment.lab_conditions import GAUGE, WIDTH, Condition, unstated
from knittest.experiment.lab_csv import Specimen
from knittest.experiment.lab_units import likely_force
from knittest.experiment.statistics import peaks

Array = NDArray[np.float64]

#: strength of textiles per width [N/mm]: from a loose knit to several layers of carbon in a strip
STRENGTH = (0.5, 3000.0)
#: what a testing machine pulls a yarn or a strip with [N]
FORCES = (0.05, 500_000.0)
#: one specimen's result over the median of the series, or the other way round: beyond it units or fabrics differ
APART = 3.0
#: widths and lengths of one series agree within this share: they are measured one by one
SERIES = 0.05


def plausible_strips(specimens: Sequence[Specimen]) -> None:
    """Raise :class:`InputError` for a force, a force per width or a strain at it that no strip or yarn has."""
    force, strain = peaks(specimens)
    for s, top, at in zip(specimens, force, strain, strict=True):
        band = FORCES if s.width is None else (STRENGTH[0] * s.width, STRENGTH[1] * s.width)
        if not band[0] <= top <= band[1]:
            per = "" if s.width is None else f", {top / s.width:.4g} N/mm of its {s.width:g} mm"
            raise InputError(
                f"{s.path}: specimen {s.name}: maximum force {top:.6g} N{per}: implausible, expected "
                f"{band[0]:g} to {band[1]:g} N{likely_force(top, s.unit, band)}: check the unit of the force"
            )
        try:
            check_bounds(float(at), field_meta(MacroMaterial, "fracture_strain"))
        except BoundsError as error:
            raise InputError(
                f"{s.path}: specimen {s.name}: strain at maximum force {at:.4g} %: {error.expected}: check the unit "
                "of the travel and the gauge length"
            ) from None
    refuse_apart([(s.name, s.path) for s in specimens], force, "maximum force", "N")
    refuse_apart([(s.name, s.path) for s in specimens], strain, "strain at maximum force", "%")


def refuse_apart(named: Sequence[tuple[str, object]], values: Array, what: str, unit: str) -> None:
    """Raise :class:`InputError` naming the specimen whose value lies a factor :data:`APART` off the others' median."""
    if len(values) < 2:
        return
    others = np.array([np.median(np.delete(values, k)) for k in range(len(values))])
    factor = np.maximum(np.abs(values / others), np.abs(others / values))
    k = int(np.argmax(factor))
    if not factor[k] <= APART:
        name, path = named[k]
        raise InputError(
            f"{path}: specimen {name}: {what} {values[k]:.4g} {unit}, the median of the other {len(values) - 1} is "
            f"{others[k]:.4g} {unit}: in another unit, or of another series? Leave it out or mend the file"
        )


def refuse_copies(named: Sequence[tuple[str, str]]) -> None:
    """Raise :class:`InputError` for two specimens, (name, digest) each, of the same numbers."""
    seen: dict[str, str] = {}
    for name, digest in named:
        if digest in seen:
            raise InputError(f"specimens {seen[digest]} and {name}: the same curve twice: leave one out")
        seen[digest] = name


def digest(*columns: Array) -> str:
    """Fingerprint of a curve by its numbers, whatever the file's delimiter and decimal mark."""
    found = hashlib.sha256()
    for column in columns:
        found.update(" ".join(f"{v:.6g}" for v in column).encode() + b";")
    return found.hexdigest()


def common(what: Condition, values: Sequence[float | None], paths: Sequence[object]) -> float:
    """Mean of ``what`` over specimens; raises :class:`InputError` where one lacks it or differs."""
    for value, path in zip(values, paths, strict=True):
        if value is None:
            raise unstated([what], path)
    found = [v for v in values if v is not None]
    for value, path in zip(found, paths, strict=True):
        if abs(value - found[0]) > SERIES * found[0]:
            raise InputError(
                f"{path}: {what.one} of {value:g} {what.unit}, {paths[0]} has {found[0]:g} {what.unit}: "
                "import series of different sizes into folders of their own"
            )
    return found[0] if np.ptp(found) == 0.0 else float(np.mean(found))


def one_series(specimens: Sequence[Specimen]) -> tuple[list[Specimen], dict[str, float]]:
    """Strips as if all were of their mean width, and that width and gauge length by their keys.

    Forces are scaled by the width that each has. Raises :class:`InputError` for strips without a width, of different
    sizes, of the same numbers, or that no fabric has.
    """
    paths = [s.path for s in specimens]
    width = common(WIDTH, [s.width for s in specimens], paths)
    found = {WIDTH.key: width}
    if any(s.gauge is not None for s in specimens):
        found[GAUGE.key] = common(GAUGE, [s.gauge for s in specimens], paths)
    plausible_strips(specimens)
    refuse_copies([(s.name, digest(s.strain, s.force)) for s in specimens])
    return [replace(s, force=s.force * (width / (s.width or width)), width=width) for s in specimens], found


def per_width(specimens: Sequence[Specimen]) -> list[Specimen]:
    """The same strips with their forces in N/mm of width."""
    return [replace(s, force=s.force / (s.width or np.nan)) for s in specimens]


def known_elsewhere(found: dict[str, Any], digests: Sequence[str]) -> bool:
    """Tell whether the statistics ``found`` of another import hold one of these curves."""
    return bool(set(digests) & set(found.get("digests", ())))
