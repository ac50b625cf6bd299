"""Macro material to the three-layer laminate of the shells, with the Poisson coupling of its two directions.

The outer layers are linear and set the bending, D = 2 (E t) z^2 in each direction; the middle layer carries the tension
curve less their share, so that the membrane force is the curve and independent of D. In tension the middle layer must
not push back: the curve's smallest tangent must exceed the outer layers' D / z^2. Layers at half the thickness satisfy
that for a fabric; a curve with a softer toe moves them out. In compression only the sum of the layers is given.

A law of two strains takes the place of both curves where directions pull each other strongly. Its middle layer is what
the outer layers leave of it, whatever its sign.
"""

from collections.abc import Mapping
from functools import cache
from math import ceil, sqrt

import numpy as np

from knittest.base.arrays import Array
from knittest.base.errors import InputError
from knittest.base.units import to_kernel
from knittest.config.fabric import Direction, Fabric
from knittest.kernels.laws import hinge_table, hinge_tables
from knittest.kernels.shell_state import Laminate
from knittest.materials.biaxial import BiaxialFit, fit_law
from knittest.materials.biaxial_table import BiaxialTable
from knittest.materials.shear import ShearCurve, shear_table, thin_curve

# Poisson coupling of a laminate's two directions, which leaves what strips of it do as it was.


def with_poisson_coupling(card: Laminate, poisson: float, name: str = "poisson") -> Laminate:
    """``card`` whose weft contracts by ``poisson`` [-] times the strain of a warp that is pulled alone.

    The weft resists contraction as it does compression, C, so that the coupling is nu C_b / (1 - nu nu'), with
    nu' = nu C_b / C_a the contraction of the warp under a pull of the weft. Both directions become stiffer by
    C nu nu' / (1 - nu nu'), of which free contraction takes as much again: a strip without load at its sides follows
    the same tension curve. Bending likewise with D. Where the directions are linear and alike this is the isotropic
    plate. Raises :class:`InputError`, for the field ``name``, where some state would have less than no energy.
    """
    if poisson == 0.0:
        return card
    pushed, bending = card.compression + 2.0 * card.outer, 2.0 * card.outer * card.layer_offset**2
    stiffer, coupling = _coupling_additions(pushed, poisson, name, "in compression")
    more_bent, twist = _coupling_additions(bending, poisson, name, "in bending")
    outer = card.outer + more_bent / (2.0 * card.layer_offset**2)
    middle = stiffer - 2.0 * (outer - card.outer)
    slope = card.slope.copy()
    slope[:, 0] += middle
    new = card._replace(
        outer=outer, slope=slope, compression=card.compression + middle,
        coupling_membrane=coupling, coupling_bending=twist,
    )  # fmt: skip
    _check(new, poisson, name)
    return new


def _coupling_additions(stiffness: Array, poisson: float, name: str, what: str) -> tuple[Array, float]:
    """Additions (2,) to the stiffnesses (2,) of strips, and the coupling."""
    if not stiffness.any():  # a membrane does not bend
        return stiffness, 0.0
    if poisson**2 * stiffness[1] >= stiffness[0]:
        most = float(np.sqrt(stiffness[0] / stiffness[1]))
        raise InputError(
            f"{name} = {poisson:g}: the stiffness {what} is {stiffness[0]:.4g} in warp and {stiffness[1]:.4g} in weft; "
            f"expected an absolute value below the square root of their ratio, {most:.4g}: else energy is negative"
        )
    back = poisson * float(stiffness[1] / stiffness[0])
    rest = 1.0 - poisson * back
    return poisson * back / rest * stiffness, poisson * float(stiffness[1]) / rest


def _check(card: Laminate, poisson: float, name: str) -> None:
    """Raise :class:`InputError` for a tangent softer than the coupling, and a middle layer that pushes under a pull."""
    middle = np.minimum(np.cumsum(card.slope, axis=1).min(axis=1), card.compression)
    softest = middle + 2.0 * card.outer
    if card.coupling_membrane**2 >= softest[0] * softest[1]:
        raise InputError(
            f"{name} = {poisson:g}: the softest tangents, {softest[0]:.4g} and {softest[1]:.4g} N/mm, cannot carry a "
            f"coupling of {abs(card.coupling_membrane):.4g} N/mm; expected a smaller absolute value"
        )
    if (np.cumsum(card.slope, axis=1) < 0.0).any():
        raise InputError(
            f"{name} = {poisson:g}: leaves less membrane stiffness than bending needs; expected a smaller absolute "
            "value, or a larger thickness"
        )


DIRECTIONS: tuple[Direction, Direction] = ("warp", "weft")
#: points of a tension curve are dropped while it moves by less than this share of its peak
CURVE_TOLERANCE = 2e-4
#: a curve may end this share before the fracture strain; its last tangent then goes on
CURVE_MARGIN = 0.02
#: outer layers may move out to this multiple of the thickness
LARGEST_LEVER = 5.0
#: share of each layer in the shear stiffness; the outer two resist twisting
SHEAR_SHARE = 1.0 / 3.0
#: transverse shear of the plate of same bending stiffness and thickness: (5/6) G t = 5 D / t^2 with G = E / 2
TRANSVERSE = 5.0
#: hourglass control as a share of the fully integrated bilinear element (size after Belytschko et al., 1984)
HOURGLASS = 0.05
#: hourglass control where fibres lean against the sides, over what shear stores in that element. Nets kink along
#: yarns, through shells, which makes coarse ones too soft (shear angle of 10 shells a width 5 % at 1, 2 % at 4) and the
#: control too stiff (2 % at 10)
HOURGLASS_SHEAR = 6.0
#: stiffness of turns about the normal over that of shear: more locks coarse curved meshes (a hemisphere of 8 x 8 by a
#: third at 0.1), less lets corners spin (1 % of a Scordelis-Lo roof of 16 x 16 at 0.001)
DRILLING = 0.01


def laminate(
    fabric: Fabric,
    curves: Mapping[Direction, tuple[Array, Array]],
    shear_curve: ShearCurve | None = None,
    table: BiaxialTable | None = None,
) -> Laminate:
    """Laminate of ``fabric`` with tension ``curves``: strain [%] and force per width [N/mm], (n,) each.

    ``shear_curve`` is that of the fabric's shear law, if it names one; ``table`` that of ``macro.biaxial``, in place of
    the curves. Raises :class:`InputError` for a tension curve
    that does not start at the origin, does not rise up to the fracture strain, ends before it, or is too soft for the
    bending stiffness, and for what :func:`shear_table` refuses.
    """
    macro, thickness = fabric.macro, fabric.thickness_mm
    fail = np.array(macro.fracture_strain_fraction or (np.inf, np.inf))
    bending = np.array(macro.bending_stiffness_n_mm)
    fit = None if table is None else fit_table(fabric, table)
    if fit is None:
        points = [_tension_points(fabric, d, curves[d], fail[i]) for i, d in enumerate(DIRECTIONS)]
    else:
        points = [_strip_points(fabric, fit, i, fail[i]) for i in range(2)]
    tangents = [np.diff(force) / np.diff(strain) for strain, force in points]
    layer_offset = _layer_offset(fabric, bending, tangents) if fit is None else 0.5 * thickness
    outer = bending / (2.0 * layer_offset**2)
    largest = np.array([t.max() for t in tangents])
    knee, slope = hinge_tables([hinge_table(strain, force) for strain, force in points])
    slope[:, 0] -= 2.0 * outer
    shear = shear_table(fabric, shear_curve)
    transverse = TRANSVERSE * bending / thickness**2
    card = Laminate(
        layer_offset=layer_offset,
        outer=outer,
        compression=(macro.compression_ratio.value * largest if fit is None else fit.law.energy_range[:, 4])
        - 2.0 * outer,
        knee=knee,
        slope=slope,
        shear_knee=shear.knee,
        shear_slope=shear.slope,
        shear_friction=shear.friction,
        shear_stick=shear.stick,
        twist=2.0 * SHEAR_SHARE * shear.twisting * (0.5 * thickness) ** 2,
        transverse=transverse,
        # hourglass patterns of a square in bilinear membrane, bending and transverse shear store k h^2 / 24
        hourglass_fibre=HOURGLASS * largest / 12.0,
        hourglass_shear=hourglass_of_shear(HOURGLASS, largest, shear.twisting),
        hourglass_bending=HOURGLASS * float(bending.mean()) / 12.0,
        hourglass_transverse=HOURGLASS * float(transverse.mean()) / 12.0,
        drilling=0.0,  # tests of the laboratory start flat; see docs/limits.md
        fail_strain=fail,
        in_plane=np.array(macro.in_plane_bending_n_mm or (0.0, 0.0)),
    )
    if fit is not None:
        return card._replace(**fit.law._asdict())
    return with_poisson_coupling(card, macro.poisson.value, f"fabric {fabric.name}, macro.poisson")


def fit_table(fabric: Fabric, table: BiaxialTable) -> BiaxialFit:
    """Law of ``table`` of ``macro.biaxial``; raises :class:`InputError` as :func:`fit_law`."""
    shape, numbers = table.force.shape, (table.warp.tobytes(), table.weft.tobytes(), table.force.tobytes())
    return _fit_once(shape, numbers, fabric.macro.compression_ratio.value, _biaxial_name(fabric))


@cache
def _fit_once(shape: tuple[int, ...], numbers: tuple[bytes, ...], compression_ratio: float, where: str) -> BiaxialFit:
    """Law of a table of given numbers: a run asks for it several times, and a fit takes a second."""
    warp, weft, force = (np.frombuffer(part) for part in numbers)
    return fit_law(BiaxialTable(warp, weft, force.reshape(shape)), compression_ratio, where)


def _biaxial_name(fabric: Fabric) -> str:
    assert fabric.macro.biaxial is not None
    return f"fabric {fabric.name}, macro.biaxial ({fabric.macro.biaxial.curve or 'points'})"


def hourglass_of_shear(share: float, stretch: Array, shear: float) -> float:
    """Hourglass stiffness [N/mm] where fibres lean against the sides: of ``shear`` [N/mm], and at most ``share`` of the
    fibres' ``stretch`` [N/mm], (2,).
    """
    return min(HOURGLASS_SHEAR * shear, share * float(stretch.mean())) / 12.0


#: membrane stiffness that bending needs, over the stiffness of an outer layer
FOR_BENDING = 2.4


def scale_membrane(card: Laminate, share: float) -> Laminate:
    """A share of the membrane stiffness at rest, in tension and compression, with the same bending.

    For tests that strain a fabric so little that no knee of its tension curve counts. With a law of two strains, as of
    slack loops, it is at least what bending needs. Raises :class:`InputError` when less is left than bending needs.
    """
    rest = card.slope[:, 0] + 2.0 * card.outer
    if card.energy is not None:
        rest, share = np.maximum(share * rest, FOR_BENDING * card.outer), 1.0
    return _linear_laminate(card, share, rest, share * rest)


def share_for_bending(card: Laminate, share: float) -> float:
    """``share`` of the membrane stiffness at rest, or where bending needs more, what is enough for it."""
    least = 2.0 * card.outer / (card.slope[:, 0] + 2.0 * card.outer)
    if card.energy is not None:
        return share
    return share if float(least.max()) < share else _sufficient_share(least)


def limit_membrane(card: Laminate, share: float) -> Laminate:
    """A share of the largest tangent in tension, as of the axial stiffness of yarns, the compression as it is unless
    that is stiffer, and the same bending; shells break at the force at which they would.

    A law of two strains stays as it is: its table gets softer instead. Raises :class:`InputError` when less is left
    than bending needs.
    """
    if card.energy is not None:
        return card
    largest = np.cumsum(card.slope, axis=1).max(axis=1) + 2.0 * card.outer
    strength = (card.slope * np.maximum(card.fail_strain[:, None] - card.knee, 0.0)).sum(axis=1)
    strength += 2.0 * card.outer * card.fail_strain
    compression = np.minimum(card.compression + 2.0 * card.outer, share * largest)
    return _linear_laminate(card, share, largest, compression)._replace(fail_strain=strength / (share * largest))


def _sufficient_share(least: Array) -> float:
    """A share, of two digits, that is a fifth above the ``least`` of each layer (2,)."""
    return min(ceil(120.0 * float(least.max())) / 100.0, 1.0)


def _linear_laminate(card: Laminate, share: float, tension: Array, compression: Array) -> Laminate:
    """A laminate with ``share`` of ``tension`` and with ``compression`` [N/mm], (2,) each, of all layers."""
    slope = share * tension - 2.0 * card.outer
    if (slope <= 0.0).any():
        raise InputError(
            f"rig.membrane_share = {share:g}: leaves less membrane stiffness than bending needs; use --set "
            f"rig.membrane_share={_sufficient_share(2.0 * card.outer / tension):g}"
        )
    return card._replace(
        knee=np.zeros((2, 1)), slope=slope[:, None], compression=compression - 2.0 * card.outer,
        coupling_membrane=share * card.coupling_membrane, energy=None,
    )  # fmt: skip


def _tension_points(
    fabric: Fabric, direction: Direction, curve: tuple[Array, Array], fail: float
) -> tuple[Array, Array]:
    """Strain [-] and force per width [N/mm] from the origin to the fracture strain ``fail``."""
    strain, force = to_kernel(1.0, "%") * np.asarray(curve[0], float), np.asarray(curve[1], float)
    where = f"fabric {fabric.name}, {_curve_name(fabric, direction)}"
    limit = f"macro.fracture_strain.{direction} = {100 * fail:g} %"
    if strain.shape != force.shape or strain.size < 2 or not np.isfinite(np.append(strain, force)).all():
        raise InputError(f"{where}: expected at least two rows of finite strain and force")
    if strain[0] > 0.0:
        strain, force = np.append(0.0, strain), np.append(0.0, force)
    if strain[0] != 0.0 or abs(force[0]) > CURVE_TOLERANCE * force.max():
        raise InputError(f"{where}: the first row is {100 * strain[0]:g} %, {force[0]:g} N/mm; expected 0 %, 0 N/mm")
    if (back := np.flatnonzero(np.diff(strain) <= 0.0)).size:
        raise InputError(f"{where}: strain_pct does not rise after {100 * strain[back[0]]:g} %; expected rising rows")
    if strain[-1] < (1.0 - CURVE_MARGIN) * fail:
        raise InputError(f"{where}: the curve ends at {100 * strain[-1]:g} %; expected it to reach {limit}")
    strain, force = _cut_curve(strain, np.append(0.0, force[1:]), fail)
    if (fall := np.flatnonzero(np.diff(force) <= 0.0)).size:
        raise InputError(
            f"{where}: the force does not rise after {100 * strain[fall[0]]:g} %; expected a rising curve up to {limit}"
        )
    return thin_curve(strain, force, CURVE_TOLERANCE * force[-1])


def _strip_points(fabric: Fabric, fit: BiaxialFit, direction: int, fail: float) -> tuple[Array, Array]:
    """Strain [-] and force [N/mm] of a strip with free sides under the law of two strains."""
    strain, force = _cut_curve(*fit.strip_curve(direction), fail)
    if (fall := np.flatnonzero(np.diff(force) <= 0.0)).size:
        raise InputError(
            f"{_biaxial_name(fabric)}: the force of a strip with free sides, "
            f"pulled along the {DIRECTIONS[direction]}, does not rise after {100 * strain[fall[0]]:.4g} %; expected a "
            "table in which it rises up to its end"
        )
    return thin_curve(strain, force, CURVE_TOLERANCE * force[-1])


def _curve_name(fabric: Fabric, direction: Direction) -> str:
    given = fabric.macro.tension[direction]
    return f"macro.tension.{direction} ({given if isinstance(given, str) else 'points'})"


def _cut_curve(strain: Array, force: Array, end: float) -> tuple[Array, Array]:
    """The curve up to the strain ``end``, or all of it when it ends before."""
    if strain[-1] <= end:
        return strain, force
    keep = strain < end
    return np.append(strain[keep], end), np.append(force[keep], np.interp(end, strain, force))


def _layer_offset(fabric: Fabric, bending: Array, tangents: list[Array]) -> float:
    """Distance of the outer layers from the middle [mm]: half the thickness, or more where the curve is soft."""
    thickness = fabric.thickness_mm
    needed = [sqrt(bending[i] / t.min()) for i, t in enumerate(tangents)]
    if max(needed) > LARGEST_LEVER * thickness:
        worst = int(np.argmax(needed))
        d, soft = DIRECTIONS[worst], float(tangents[worst].min()) * to_kernel(1.0, "%")
        raise InputError(
            f"fabric {fabric.name}, {_curve_name(fabric, d)}: smallest tangent {soft:.3g} N/mm "
            f"per % of strain, too soft for macro.bending_stiffness.{d} = {bending[worst]:g} N mm; expected a curve "
            "without a force-free start"
        )
    return max(0.5 * thickness, *needed)
