"""Yarn cards to section constants: cross-section integration rule and axial law as hinge tables."""

from dataclasses import dataclass, replace
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import InputError
from knittest.base.units import to_kernel
from knittest.config.fabric import Fabric
from knittest.config.yarn import ReinforcingYarn, Yarn
from knittest.config.yarn_law import YarnLaw

Array = NDArray[np.float64]

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
SYSTEMS = ("warp", "weft", "knit")


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
    with np.errstate(over="ignore", invalid="ignore"):  # refused where it is used
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
            f"law of a yarn: its steepest piece is {tangent:g} MPa; expected points whose stress [MPa] rises with "
            "strain [%] somewhere, by less than a number can hold"
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
    """Sections of warp, weft and knitting yarn with a share of their axial and shear stiffness."""
    reinforcing = fabric.reinforcing
    cards = (
        _elliptic(section(reinforcing, reinforcing.bending_stiffness_n_mm2.warp), reinforcing, "warp"),
        _elliptic(section(reinforcing, reinforcing.bending_stiffness_n_mm2.weft), reinforcing, "weft"),
        section(fabric.knitting, fabric.knitting.bending_stiffness_n_mm2),
    )
    return tuple(_softened(card, axial_share) for card in cards)


def _elliptic(card: Section, yarn: ReinforcingYarn, direction: str) -> Section:
    if yarn.section is None:
        return card
    width, height = yarn.section_mm(direction)
    law = yarn.section.flattening
    lateral = None if law is None else (law.modulus_mpa, law.exponent)
    return replace(card, radius=0.5 * height, half_width=0.5 * width, lateral=lateral)


def _softened(card: Section, share: float) -> Section:
    """``card`` with a ``share`` of its stiffness: it carries each force at 1 / share of the strain."""
    return replace(
        card, axial=share * card.axial, shear=share * card.shear, hinge_strain=card.hinge_strain / share,
        hinge_slope=share * card.hinge_slope, compression=share * card.compression,
    )  # fmt: skip
