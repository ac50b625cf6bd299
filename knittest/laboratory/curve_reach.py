"""Part of a tension curve that a fracture strain leaves the shells: they are deleted there."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from knittest.base.errors import InputError
from knittest.config.base import Quantity
from knittest.config.fabric import Direction, Fabric
from knittest.config.yarn import TENACITY
from knittest.experiment.borrowed import borrowed
from knittest.experiment.curves import ReferenceCurve

#: a fracture strain may stand this share before the strain at the largest force: rounding, and the mean of peaks
MARGIN = 0.02


@dataclass(frozen=True)
class Reach:
    """Largest force of a curve, at ``end`` [%], beside the ``fracture_strain`` of its ``direction``.

    ``lost`` is the share of that force which the shells do not reach [-]; ``borrowed``: the curve is another fabric's.
    """

    direction: Direction
    end: float
    fracture_strain: Quantity
    lost: float
    borrowed: bool

    @property
    def is_cut(self) -> bool:
        """Tell whether the fracture strain lies before the largest force by more than the margin."""
        return self.fracture_strain.value < (1.0 - MARGIN) * self.end

    @property
    def is_blunder(self) -> bool:
        """Tell whether nobody vouches for the number that cuts the fabric's own curve."""
        return self.is_cut and self.fracture_strain.source == "assumed" and not self.borrowed

    def text(self) -> str:
        """Sentence on what is cut, and by how much."""
        strain = self.fracture_strain
        return (
            f"macro.fracture_strain.{self.direction} = {strain.value:g} % ({strain.source}) cuts macro.tension."
            f"{self.direction}, whose largest force is at {self.end:.4g} %: {100.0 * self.lost:.0f} % of it are lost"
        )


def reaches(fabric: Fabric, curves: Mapping[Direction, ReferenceCurve]) -> list[Reach]:
    """Parts of its tension ``curves`` that the fracture strains of ``fabric`` leave."""
    owners = borrowed(fabric)
    found = []
    for direction, curve in curves.items():
        top, strain = int(np.argmax(curve.mean)), fabric.macro.fracture_strain.of(direction)
        lost = 1.0 - float(np.interp(strain.value, curve.x, curve.mean)) / float(curve.mean[top])
        end = float(curve.x[top])
        found.append(Reach(direction, end, strain, lost, f"macro.tension.{direction}" in owners))
    return found


def refuse_blunders(fabric: Fabric, curves: Mapping[Direction, ReferenceCurve]) -> None:
    """Raise :class:`InputError` for an assumed fracture strain that cuts a curve of the fabric's own."""
    for one in reaches(fabric, curves):
        if one.is_blunder:
            raise InputError(
                f"fabric {fabric.name}, {one.text()}; expected that of your tests, about {one.end:.3g} %, with its "
                "source (knittest new NAME --from FOLDER takes it over from the import)"
            )


def refuse_too_strong(fabric: Fabric, curves: Mapping[Direction, ReferenceCurve]) -> None:
    """Raise :class:`InputError` for a curve that no fibres of the area mass of ``fabric`` can carry."""
    most = TENACITY * fabric.area_mass.value  # g/m2 are tex a mm of width
    for direction, curve in curves.items():
        if (top := float(np.max(curve.mean))) > most:
            raise InputError(
                f"fabric {fabric.name}, macro.tension.{direction} ({curve.file}): {top:.4g} N/mm at area_mass = "
                f"{fabric.area_mass.value:g} g/m2, expected at most {most:.4g} N/mm, {TENACITY:g} N/tex as of fibres: "
                "the force of a whole strip? Then name the column force_n, under a line # strip_width_mm: ..."
            )


def cut_curves(fabric: Fabric, curves: Mapping[Direction, ReferenceCurve]) -> tuple[str, ...]:
    """A warning for each curve that a stated fracture strain cuts."""
    return tuple(one.text() for one in reaches(fabric, curves) if one.is_cut)
