"""Sections of beams and laminates of shells by their stiffnesses, for problems posed by hand, and the forces they
carry.
"""

from math import pi, tanh

import numpy as np
from numpy.typing import ArrayLike

from knittest.base.arrays import Array, Index
from knittest.base.errors import InputError
from knittest.kernels.beam import axial_strain, flat_moment, mean_frame, section_force, section_moment
from knittest.kernels.laws import hinge_table
from knittest.kernels.shell_state import Laminate
from knittest.kernels.state import Beams, Nodes
from knittest.materials.laminate import DRILLING, hourglass_of_shear, with_poisson_coupling
from knittest.materials.yarn_section import POISSON, Section, stable_shear
from knittest.models.inputs import finite_array, number_above, one_per_element, tension_law


def section(
    axial: float,
    bending: float,
    radius: float,
    linear_density: float,
    *,
    torsion: float | None = None,
    shear: float | None = None,
    law: tuple[ArrayLike, ArrayLike] | None = None,
    across: float | None = None,
) -> Section:
    """Section by its stiffnesses EA [N] and EI [N mm^2], contact ``radius`` [mm] and mass per length [g/mm].

    GJ and GA default to those of an isotropic section with nu = 0.3. ``law`` is a table of axial strain [-] and force
    [N] from (0, 0); its first tangent holds in compression, and GA is by default large enough for its sections to be
    stable up to its end (:func:`~knittest.materials.yarn_section.stable_shear`). A flat section bends with ``bending``
    but for bending about the ``normal`` of its :class:`Chain`, in which it has the EI ``across`` [N mm^2]; its
    ``torsion`` must be given. It touches others as a round one does.
    """
    if across is not None and (torsion is None or not across > 0.0):
        raise InputError("section: across must be above 0 and needs torsion, which does not follow from two EI")
    number_above(axial, "EA of a section [N]")
    number_above(linear_density, "linear_density of a section [g/mm]")
    for name, value in (("EI", bending), ("radius", radius), ("GJ", torsion or 0.0), ("GA", shear or 0.0)):
        number_above(value, f"{name} of a section", equal=True)
    knee, slope, least = np.zeros(1), np.full(1, axial), 0.0
    if law is not None:
        strain, force = tension_law(*law)
        knee, slope = hinge_table(strain, force)
        least = stable_shear(knee, slope, float(strain[-1]))
    tangent = float(np.cumsum(slope).max())
    return Section(
        axial=max(axial, tangent),
        shear=max(5.0 / 12.0 / (1.0 + POISSON) * axial, least) if shear is None else shear,
        torsion=bending / (1.0 + POISSON) if torsion is None else torsion,
        bending=bending,
        radius=radius,
        linear_density=linear_density,
        hinge_strain=knee,
        hinge_slope=slope,
        compression=float(slope[0]),
        offset_factor=1.0,
        across=across,
    )


def round_section(modulus: float, diameter: float, density: float) -> Section:
    """Solid circle: ``modulus`` [MPa], ``diameter`` [mm], ``density`` [g/mm^3]."""
    area = 0.25 * pi * diameter**2
    return section(modulus * area, modulus * pi * diameter**4 / 64.0, 0.5 * diameter, density * area)


def strip_section(modulus: float, width: float, thickness: float, density: float) -> Section:
    """Solid rectangle: ``modulus`` [MPa], sides [mm], ``density`` [g/mm^3]; the chain's ``normal`` is across the width.

    So it bends in the plane of its width with E t w^3 / 12 and out of it with E w t^3 / 12. GJ after Saint-Venant,
    G w t^3 (1 - 192 t / (pi^5 w) sum_k tanh(k pi w / (2 t)) / k^5) / 3 over odd k, t <= w, nu = 0.3.
    """
    if not 0.0 < thickness <= width:
        raise InputError(f"strip: expected a thickness above 0 up to the width {width:g} mm, got {thickness:g}")
    area, slim = width * thickness, width / thickness
    edge = sum(tanh(0.5 * k * pi * slim) / k**5 for k in range(1, 20, 2))
    shear_modulus = modulus / (2.0 * (1.0 + POISSON))
    return section(
        modulus * area,
        modulus * width * thickness**3 / 12.0,
        0.5 * thickness,
        density * area,
        torsion=shear_modulus * width * thickness**3 * (1.0 - 192.0 / (pi**5 * slim) * edge) / 3.0,
        shear=5.0 / 6.0 * shear_modulus * area,
        across=modulus * thickness * width**3 / 12.0,
    )


def linear_laminate(
    membrane: tuple[float, float],
    bending: tuple[float, float],
    shear: float,
    thickness: float,
    *,
    twist: float | None = None,
    hourglass: float = 0.05,
    drilling: float = DRILLING,
    fail_strain: tuple[float, float] = (np.inf, np.inf),
    poisson: float = 0.0,
    in_plane: tuple[float, float] = (0.0, 0.0),
) -> Laminate:
    """Linear laminate: ``membrane`` stiffness [N/mm] and ``bending`` stiffness [N mm] of warp and weft, ``shear``
    [N/mm].

    The outer layers lie at half the ``thickness`` [mm]; transverse shear is that of the plate, 5 D / t^2. ``twist``
    [N mm] is the energy's factor of (2 kappa_ab)^2 / 2, by default that of three equal layers of the shear stiffness,
    S t^2 / 6, twice that of a homogeneous plate, S t^2 / 12. ``hourglass`` control as a share of the fully integrated
    element where fibres lie along the sides; where they lean against them it follows shear, up to that share.
    ``drilling``, the stiffness of turns about the normal, as a share of shear. ``poisson``: contraction of weft over
    the strain of the warp when that is pulled alone, in membrane and bending, whose stiffnesses stay those of strips,
    E t and E t^3 / 12; transverse shear is that over 1 + nu. ``in_plane`` [N mm]: bending stiffness of the yarns in the
    plane, EI over their distance. Raises :class:`InputError` for a bending stiffness that the membrane
    cannot have at this thickness, and for a ``poisson`` whose square is not below the ratio of warp to weft.
    """
    stretch, bend = _check_stiffnesses(membrane, bending, shear, thickness, poisson)
    for name, value in (("hourglass", hourglass), ("drilling", drilling), ("twist", twist or 0.0)):
        number_above(value, name, equal=True)
    if (one_per_element(fail_strain, "fail_strain of warp and weft", 2) <= 0.0).any():
        raise InputError("fail_strain: expected more than 0")
    yarns = finite_array(in_plane, "in_plane", (2,))
    number_above(float(yarns.min()), "in_plane", equal=True)
    layer_offset = 0.5 * thickness
    outer = bend / (2.0 * layer_offset**2)
    transverse = 5.0 * bend / thickness**2 / (1.0 + poisson)
    card = Laminate(
        layer_offset=layer_offset, outer=outer, compression=stretch - 2.0 * outer, knee=np.zeros((2, 1)),
        slope=(stretch - 2.0 * outer)[:, None].copy(), shear_knee=np.zeros(1), shear_slope=np.full(1, float(shear)),
        shear_friction=0.0, shear_stick=1.0, twist=2.0 / 3.0 * shear * layer_offset**2 if twist is None else twist,
        transverse=transverse,
        hourglass_fibre=hourglass * stretch / 12.0,
        hourglass_shear=hourglass_of_shear(hourglass, stretch, float(shear)),
        hourglass_bending=hourglass * float(bend.mean()) / 12.0,
        hourglass_transverse=hourglass * float(transverse.mean()) / 12.0,
        drilling=drilling * float(shear),
        fail_strain=np.array(fail_strain, float),
        in_plane=yarns,
    )  # fmt: skip
    return with_poisson_coupling(card, poisson)


def _check_stiffnesses(
    membrane: tuple[float, float], bending: tuple[float, float], shear: float, thickness: float, poisson: float
) -> tuple[Array, Array]:
    """Stiffnesses of membrane and bending (2,) of a laminate that there can be; raises :class:`InputError`."""
    stretch, bend = finite_array(membrane, "membrane", (2,)), finite_array(bending, "bending", (2,))
    number_above(float(stretch.min()), "membrane [N/mm]")
    number_above(float(bend.min()), "bending [N mm]", equal=True)
    number_above(shear, "shear [N/mm]", equal=True)
    number_above(thickness, "thickness [mm]")
    number_above(poisson, "poisson", -1.0)
    if (stretch <= 2.0 * (bend / (2.0 * (0.5 * thickness) ** 2))).any():
        least = float((2.0 * np.sqrt(bend / stretch)).max())
        raise InputError(
            f"bending {bending} N mm is too much for membrane {membrane} N/mm at thickness {thickness:g} mm: the "
            f"middle layer would be negative; expected a thickness above {least:.4g} mm"
        )
    return stretch, bend


def beam_resultants(nodes: Nodes, beams: Beams, element: Index, section: Index) -> dict[str, Array]:
    """Force [N] and moment [N mm] in the middle of each beam, (n_el, 3) in global axes, 0 where it is broken.

    ``element`` (n_el,) first node of each, ``section`` (n_el,) its card. They are what the side of the second node
    exerts on that of the first. ``axial_force``, ``shear_force`` [N], ``torsion`` and ``bending`` [N mm], (n_el,), are
    the parts along the axis and the sizes of those across it; ``bending_normal`` is the part about the normal of a flat
    section.
    """
    i, j = element, element + 1
    ax, ay, az, cx, cy, cz, inv = mean_frame.py_func(*nodes.rotation[:, i], *nodes.rotation[:, j], *beams.tangent[:, i])
    axis, turn = np.array([ax, ay, az]), np.array([cx, cy, cz])
    chord, inv_length = nodes.position[:, j] - nodes.position[:, i], beams.inv_length[i]
    compression, shear, torsion, bending = beams.stiffness[section].T
    strain = axial_strain.py_func(*axis, *chord, inv_length)
    axial = compression * np.minimum(strain, 0.0)
    for knee, slope in zip(beams.hinge_strain[section].T, beams.hinge_slope[section].T, strict=True):
        axial = axial + slope * np.maximum(strain - beams.slack[i] - knee, 0.0)
    force = np.array(section_force.py_func(axial, strain, shear, *axis, *chord, inv_length))
    couple = np.cross(chord, force, axis=0)
    moment = np.array(section_moment.py_func(torsion, bending, inv, inv_length, *axis, *turn, *couple))
    normal = np.array(mean_frame.py_func(*nodes.rotation[:, i], *nodes.rotation[:, j], *beams.normal[:, i])[:3])
    moment += np.array(flat_moment.py_func(beams.excess[section], inv, inv_length, *normal, *turn))
    force, moment = beams.alive[i] * force, beams.alive[i] * moment
    along, about = np.sum(force * axis, axis=0), np.sum(moment * axis, axis=0)
    return {
        "force": force.T, "moment": moment.T, "axial_force": along, "torsion": about,
        "shear_force": np.linalg.norm(force - along * axis, axis=0),
        "bending": np.linalg.norm(moment - about * axis, axis=0), "bending_normal": np.sum(moment * normal, axis=0),
    }  # fmt: skip
