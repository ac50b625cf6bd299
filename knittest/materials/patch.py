"""The patch over which two crossed yarns touch, and the lever of the friction moment that it gives.

Pressed flanks of curvature radii r1, r2 [mm] that are d [mm] deep in each other meet where x^2 / 2 r1 + y^2 / 2 r2 < d:
an ellipse of half axes sqrt(2 r1 d), sqrt(2 r2 d), as large as a disc of R = (4 r1 r2)^(1/4) sqrt(d). Each yarn gives
way by its lateral compaction, p = modulus (share of its height)^m, place by place (Winkler), so that both in a row are
a foundation of p = (u / s)^m, s = sum of height / modulus^(1/m), with height = 2 r and the width 2 r of a circle. An
ellipse of half axes a and b that lies flat has the height 2 b, r = a^2 / b and the width 2 a. Hence

    N = 2 pi sqrt(r1 r2) d^(m + 1) / ((m + 1) s^m),    hence R in proportion to N^(1 / (2 m + 2)).

m = 1 is a fibre mass at its start (van Wyk 1946: p = k E (v^3 - v0^3) at fibre shares v, v0: modulus 3 k E v0^3); a
larger one stiffens. The limit of the moment is mu N l: pressure in proportion to (1 - r^2 / R^2)^m over a disc gives
l = (m + 1) B(3/2, m + 1) R, which is 2/3 R for even pressure (m = 0), 3 pi / 16 R for Hertz's (1/2), 8/15 R for m = 1,
0.406 R for m = 3. Grosberg & Park (1966) put the frictional restraint of crossings down to such a length of contact.
"""

from dataclasses import dataclass
from math import gamma, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.config.contact import LateralCompaction
from knittest.config.fabric import Fabric
from knittest.materials.yarn_section import SYSTEMS

Array = NDArray[np.float64]

#: lever over radius of a disc of even pressure
EVEN = 2.0 / 3.0
#: coefficient of a lever that does not depend on the force
ANY = 1e30


@dataclass(frozen=True, eq=False)
class Patch:
    """Levers min(coefficient N^(1 / (2 exponent + 2)), most) of the friction moment, by the parts of both yarns.

    ``coefficient`` [mm / N^p] and ``most`` [mm], (n_parts, n_parts) or (1, 1) for all; ``exponent`` 1 or 3, 0
    where the coefficient does not count.
    """

    coefficient: Array
    most: Array
    exponent: int = 0

    def __post_init__(self) -> None:
        for name in ("coefficient", "most"):
            table = np.asarray(getattr(self, name), float)
            if not (np.isfinite(table) & (table >= 0.0)).all():
                raise InputError(f"{name} of a patch: expected finite numbers, 0 or more")
            if table.ndim != 2 or not np.array_equal(table, table.T):
                raise InputError(f"{name} of a patch: expected a row and a column for each part, the same both ways")
        if self.exponent not in (0, 1, 3):
            raise InputError(f"exponent of a patch: {self.exponent}; expected 1 or 3, or 0 for given sizes")

    @classmethod
    def disc(cls, radius: float) -> "Patch":
        """Discs of ``radius`` [mm] and even pressure at all crossings."""
        return cls(np.full((1, 1), ANY), np.full((1, 1), EVEN * radius))

    def levers(self, n_parts: int) -> Array:
        """Return coefficients and largest values for ``n_parts`` parts, (2, n_parts, n_parts)."""
        shape = (n_parts, n_parts)
        if self.most.shape not in ((1, 1), shape) or self.coefficient.shape not in ((1, 1), shape):
            raise InputError(
                f"patch: tables of {len(self.most)} parts for {n_parts}; expected one for each, or one for all"
            )
        return np.stack([np.broadcast_to(self.coefficient, shape), np.broadcast_to(self.most, shape)])

    @property
    def least(self) -> float:
        """Smallest of the largest levers that are not 0 [mm]; 0 where all are."""
        given = self.most[self.most > 0.0]
        return float(given.min()) if given.size else 0.0


def lever_share(exponent: float) -> float:
    """Lever over radius of a disc whose pressure is in proportion to (1 - r^2 / R^2)^exponent."""
    return (exponent + 1.0) * gamma(1.5) * gamma(exponent + 1.0) / gamma(exponent + 2.5)


def patch_radius(
    force: float,
    radii: tuple[float, float],
    moduli: tuple[float, float],
    exponent: float,
    heights: tuple[float, float] | None = None,
) -> float:
    """Radius [mm] of the patch of two crossed yarns under ``force`` [N].

    ``radii`` [mm] of their flanks' curvature, ``moduli`` [MPa] and ``exponent`` of their lateral compaction;
    ``heights`` [mm] of their sections, by default those of circles.
    """
    width, (h1, h2) = sqrt(radii[0] * radii[1]), heights or (2.0 * radii[0], 2.0 * radii[1])
    give = sum(height * modulus ** (-1.0 / exponent) for height, modulus in zip((h1, h2), moduli, strict=True))
    depth = (force * (exponent + 1.0) * give**exponent / (2.0 * pi * width)) ** (1.0 / (exponent + 1.0))
    return sqrt(2.0 * depth * width)


def fabric_patch(fabric: Fabric) -> Patch | None:
    """Patch of the crossings of a fabric by yarn system; None where none is given."""
    card = fabric.contact.patch
    if card is not None and card.compaction is not None:
        return _compacted(fabric, card.compaction)
    if card is not None and card.radius is not None:
        loops = np.array([system == "knit" for system in SYSTEMS])
        kinds = np.array([card.radius.inlay_inlay_mm, card.radius.inlay_loop_mm, card.radius.loop_loop_mm])
        most = EVEN * kinds[loops[:, None].astype(int) + loops]
        return Patch(np.full(most.shape, ANY), most)
    return None


def _compacted(fabric: Fabric, law: LateralCompaction) -> Patch:
    """Patches that grow by ``law``, no wider than the yarns, and by then pressed evenly."""
    exponent, share, yarns = law.exponent, lever_share(law.exponent), [_flank(fabric, law, s) for s in SYSTEMS]
    grown = [
        [share * patch_radius(1.0, (r1, r2), (e1, e2), exponent, (h1, h2)) for _, h2, r2, e2 in yarns]
        for _, h1, r1, e1 in yarns
    ]
    widest = [[EVEN * sqrt(a1 * a2) for a2, *_ in yarns] for a1, *_ in yarns]
    return Patch(np.array(grown), np.array(widest), exponent)


def _flank(fabric: Fabric, law: LateralCompaction, system: str) -> tuple[float, float, float, float]:
    """Half width, height, radius of curvature [mm] and modulus [MPa] of the flank that yarns of ``system`` press."""
    if system == "knit":
        diameter = fabric.knitting.beam_diameter_mm
        return 0.5 * diameter, diameter, 0.5 * diameter, law.knitting_mpa
    width, height = fabric.reinforcing.section_mm(system)
    return 0.5 * width, height, 0.5 * width * (width / height), law.reinforcing_mpa
