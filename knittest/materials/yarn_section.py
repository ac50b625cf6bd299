"""Yarn cards to section constants: cross-section integration rule and axial law as hinge tables; the contact patch of
crossed yarns.
"""

from dataclasses import dataclass, replace
from math import gamma, pi, sqrt

import numpy as np

from knittest.base.arrays import Array
from knittest.base.errors import InputError
from knittest.base.units import to_kernel
from knittest.config.fabric import Fabric
from knittest.config.laws import LateralCompaction, YarnLaw
from knittest.config.structure import KNIT, Inlays
from knittest.config.yarn import Yarn

#: Poisson-like ratio that links the shear modulus of a section to its axial modulus (assumed, isotropic value)
POISSON = 0.3
#: GA over the least that keeps sections stable: at fracture at least half of their resistance to turning is left
SHEAR_MARGIN = 2.0
#: GA over the steepest EA, up to which GA is raised: towards 1 the rotary inertia that the step needs has no bound
MOST_SHEAR = 0.9
#: strength of a yarn away from its weakest place, above its drawn strength, relative
STRENGTH_MARGIN = 0.15
#: standard deviations above the mean up to which drawn fracture strains are followed
SCATTER = 4.0
#: segments that replace the parabola of a toe; the area error is 1 / (2 n^2) of the toe's
TOE_SEGMENTS = 8


@dataclass(frozen=True, eq=False)
class Section:
    """Constants of one yarn system: EA, GA [N], GJ, EI [N mm^2], radius [mm], mass per length [g/mm].

    The axial law is N(e) = compression * min(e, 0) + sum_k slope[k] max(e - strain[k], 0). ``offset_factor`` is the
    ring radius of the integration rule over the one that gives the solid circle's EI. A flat section has another EI
    ``across`` [N mm^2] for bending about the normal of its chain (None: round). An elliptic one has its height, 2 x
    ``radius``, along that normal, and a ``half_width`` [mm] across it (None: round), and flattens by its
    ``lateral`` modulus [MPa] and exponent (None: rigid).
    """

    axial: float
    shear: float
    torsion: float
    bending: float
    radius: float
    linear_density: float
    hinge_strain: Array
    hinge_slope: Array
    compression: float
    offset_factor: float
    across: float | None = None
    half_width: float | None = None
    lateral: tuple[float, int] | None = None

    @property
    def wide(self) -> float:
        """Half width [mm], of a round section its radius."""
        return self.radius if self.half_width is None else self.half_width

    @property
    def squeezable(self) -> float:
        """Lateral modulus [MPa], 0 where the section is rigid."""
        return 0.0 if self.lateral is None else self.lateral[0]

    @property
    def exponent(self) -> float:
        """Exponent of the law of lateral compaction."""
        return 1.0 if self.lateral is None else float(self.lateral[1])

    @property
    def excess(self) -> float:
        """EI about the normal less the other [N mm^2], 0 for a round section."""
        return 0.0 if self.across is None else self.across - self.bending


def ring_rule(area: float, second_moment: float, points: int = 8) -> tuple[Array, Array, Array]:
    """Integration points y, z [mm] and areas [mm^2] on a ring with the given area and second moment [mm^4].

    Hughes-Liu section rule: EA = E sum a, EI = E sum a z^2; the ring radius sqrt(2 I / A) sets bending apart from
    tension (the solid circle needs d / sqrt(8)).
    """
    angle = 2.0 * pi * np.arange(points) / points
    radius = sqrt(2.0 * second_moment / area)
    return radius * np.cos(angle), radius * np.sin(angle), np.full(points, area / points)


def hinges(law: YarnLaw, modulus: float) -> tuple[Array, Array]:
    """Knee strains [-] and slope changes [MPa] of an axial law; the slopes sum to the tangent of the last piece."""
    if law.kind == "linear":
        return np.zeros(1), np.full(1, modulus)
    if law.kind == "toe":
        # stress E e^2 / (2 e_t) up to e_t, then E (e - e_t / 2): tangents at the middles of equal pieces
        toe = to_kernel(law.toe_strain, "%")
        middle = (np.arange(TOE_SEGMENTS) + 0.5) / TOE_SEGMENTS
        tangent = np.append(modulus * middle, modulus)
        return toe * np.arange(TOE_SEGMENTS + 1) / TOE_SEGMENTS, np.diff(tangent, prepend=0.0)
    strain = to_kernel(1.0, "%") * np.array([p[0] for p in law.points])
    stress = np.array([p[1] for p in law.points])
    with np.errstate(over="ignore", invalid="ignore"):  # rejected where it is used
        return strain[:-1], np.diff(np.diff(stress) / np.diff(strain), prepend=0.0)


def stable_shear(knee: Array, slope: Array, strain: float) -> float:
    """Shear stiffness GA [N] that keeps the sections of a straight yarn across its axis up to an axial ``strain`` [-].

    ``knee`` [-] and ``slope`` [N] are the hinges of its law N(e), both (n,). A beam of stretch l = 1 + e whose sections
    all turn by a small angle t against its axis stores, per length, the integral of the law up to l cos(t) - 1, and
    GA (l sin(t))^2 / 2. The second derivative of this energy by t is l (GA l - N): sections are stable while

        GA > N(e) / (1 + e).

    Bending only adds to it, in proportion to the square of the wave number (Reissner, 1981). The right-hand side is
    monotonic between two knees, so that its maximum is at a knee or at the end. The result is :data:`SHEAR_MARGIN`
    times it, which leaves half of the resistance to turning, and at most :data:`MOST_SHEAR` of the steepest EA, which
    exceeds it up to a strain of 900 %.
    """
    ends = np.append(knee[knee < strain], strain)
    force = (slope * np.maximum(ends[:, None] - knee, 0.0)).sum(axis=1)
    steepest = float(np.cumsum(slope).max())
    return min(SHEAR_MARGIN * float((force / (1.0 + ends)).max()), MOST_SHEAR * steepest)


def largest_strain(yarn: Yarn) -> float:
    """Axial strain [-] that the strongest element of ``yarn`` can reach, with the scatter of its fracture strain."""
    strain = yarn.fracture_strain
    return yarn.fracture_strain_fraction * (1.0 + STRENGTH_MARGIN) * (1.0 + SCATTER * (strain.sd or 0.0) / strain.value)


def section(yarn: Yarn, bending: float) -> Section:
    """Section constants of ``yarn`` with bending stiffness EI ``bending`` [N mm^2].

    GA is that of an isotropic section of the yarn's modulus, or more where :func:`stable_shear` needs it.
    """
    modulus, area, diameter = yarn.youngs_modulus_mpa, yarn.load_area_mm2, yarn.beam_diameter_mm
    y, z, a = ring_rule(area, bending / modulus)
    strain, slope = hinges(yarn.law, modulus)
    tangent = float(np.max(np.cumsum(slope)))
    if not 0.0 < tangent < np.inf:
        raise InputError(
            f"law of a yarn: its largest tangent modulus is {tangent:g} MPa; expected a finite value above 0: stress "
            "[MPa] must rise with strain [%]"
        )
    shear_modulus = modulus / (2.0 * (1.0 + POISSON))
    torsion = shear_modulus * float((a * (y**2 + z**2)).sum())
    if yarn.torsion_ratio is not None:
        torsion = yarn.torsion_ratio.value * bending
    ring, least = float(np.hypot(y[0], z[0])), stable_shear(strain, slope * float(a.sum()), largest_strain(yarn))
    return Section(
        axial=tangent * float(a.sum()),
        shear=max(5.0 / 6.0 * shear_modulus * float(a.sum()), least),
        torsion=torsion,
        bending=modulus * float((a * z**2).sum()),
        radius=0.5 * diameter,
        linear_density=yarn.linear_density_g_per_mm,
        hinge_strain=strain,
        hinge_slope=slope * float(a.sum()),
        compression=float(slope[0]) * float(a.sum()),
        offset_factor=ring * sqrt(8.0) / diameter,
    )


def sections(fabric: Fabric, axial_share: float = 1.0) -> tuple[Section, ...]:
    """Sections of the yarn systems in the order of :func:`systems_of`, with a share of axial and shear stiffness."""
    cards = [_with_ellipse(section(one.yarn, one.bending), one) for one in fabric.inlays]
    cards.append(section(fabric.knitting, fabric.knitting.bending_stiffness_n_mm2))
    return tuple(_scale_stiffness(card, axial_share) for card in cards)


def systems_of(fabric: Fabric) -> tuple[str, ...]:
    """Names of the yarn systems, which are the parts of a meso model: layers from back to face, then the loops."""
    return (*(one.name for one in fabric.inlays), KNIT)


def _with_ellipse(card: Section, inlays: Inlays) -> Section:
    if inlays.yarn.section is None:
        return card
    width, height = inlays.section_mm
    law = inlays.yarn.section.flattening
    lateral = None if law is None else (law.modulus_mpa, law.exponent)
    return replace(card, radius=0.5 * height, half_width=0.5 * width, lateral=lateral)


def _scale_stiffness(card: Section, share: float) -> Section:
    """``card`` with a ``share`` of its stiffness: each force at 1 / share of the strain."""
    return replace(
        card, axial=share * card.axial, shear=share * card.shear, hinge_strain=card.hinge_strain / share,
        hinge_slope=share * card.hinge_slope, compression=share * card.compression,
    )  # fmt: skip


# The patch over which two crossed yarns touch, and the lever of the friction moment that it gives.
#
# Pressed flanks of curvature radii r1, r2 [mm] that are d [mm] deep in each other meet where x^2 / 2 r1 + y^2 / 2 r2 <
# d: an ellipse of half axes sqrt(2 r1 d), sqrt(2 r2 d), as large as a disc of R = (4 r1 r2)^(1/4) sqrt(d). Each yarn
# gives way by its lateral compaction, p = modulus (share of its height)^m, place by place (Winkler), so that both in a
# row are a foundation of p = (u / s)^m, s = sum of height / modulus^(1/m), with height = 2 r and the width 2 r of a
# circle. An ellipse of half axes a and b that lies flat has the height 2 b, r = a^2 / b and the width 2 a. Hence
#
#     N = 2 pi sqrt(r1 r2) d^(m + 1) / ((m + 1) s^m),    hence R in proportion to N^(1 / (2 m + 2)).
#
# m = 1 is a fibre mass at its start (van Wyk 1946: p = k E (v^3 - v0^3) at fibre shares v, v0: modulus 3 k E v0^3); a
# larger one stiffens. The limit of the moment is mu N l: pressure in proportion to (1 - r^2 / R^2)^m over a disc gives
# l = (m + 1) B(3/2, m + 1) R, which is 2/3 R for even pressure (m = 0), 3 pi / 16 R for Hertz's (1/2), 8/15 R for m =
# 1, 0.406 R for m = 3. Grosberg & Park (1966) put the frictional restraint of crossings down to such a length of
# contact.

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
                raise InputError(f"{name} of a patch: expected a symmetric table with a row for each part")
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
                f"patch: its tables have {len(self.most)} rows for {n_parts} parts; expected one per part, or one"
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
        return _compaction_patch(fabric, card.compaction)
    if card is not None and card.radius is not None:
        loops = np.array([system == KNIT for system in systems_of(fabric)])
        kinds = np.array([card.radius.inlay_inlay_mm, card.radius.inlay_loop_mm, card.radius.loop_loop_mm])
        most = EVEN * kinds[loops[:, None].astype(int) + loops]
        return Patch(np.full(most.shape, ANY), most)
    return None


def _compaction_patch(fabric: Fabric, law: LateralCompaction) -> Patch:
    """Patches that grow by ``law``, no wider than the yarns, and by then pressed evenly."""
    exponent, share = law.exponent, lever_share(law.exponent)
    diameter = fabric.knitting.beam_diameter_mm
    yarns = [_flank(*one.section_mm, law.reinforcing_mpa) for one in fabric.inlays]
    yarns.append(_flank(diameter, diameter, law.knitting_mpa))
    grown = [
        [share * patch_radius(1.0, (r1, r2), (e1, e2), exponent, (h1, h2)) for _, h2, r2, e2 in yarns]
        for _, h1, r1, e1 in yarns
    ]
    widest = [[EVEN * sqrt(a1 * a2) for a2, *_ in yarns] for a1, *_ in yarns]
    return Patch(np.array(grown), np.array(widest), exponent)


def _flank(width: float, height: float, modulus: float) -> tuple[float, float, float, float]:
    """Half width, height, radius of curvature [mm] and modulus [MPa] of the flank of yarns of these sections."""
    return 0.5 * width, height, 0.5 * width * (width / height), modulus
