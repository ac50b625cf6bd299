"""Sections of beams and laminates of shells by their stiffnesses, for bodies posed by hand."""

from math import pi

import numpy as np
from numpy.typing import ArrayLike

from knittest.base.errors import InputError
from knittest.kernels.laws import hinge_table
from knittest.kernels.shell_state import Laminate
from knittest.materials.yarn_section import POISSON, Section
from knittest.models.inputs import finite


def section(
    axial: float,
    bending: float,
    radius: float,
    linear_density: float,
    *,
    torsion: float | None = None,
    shear: float | None = None,
    law: tuple[ArrayLike, ArrayLike] | None = None,
) -> Section:
    """Section by its stiffnesses EA [N] and EI [N mm^2], contact ``radius`` [mm] and mass per length [g/mm].

    GJ and GA default to those of an isotropic section with nu = 0.3. ``law`` is a table of axial strain [-] and force
    [N] from (0, 0); its first tangent holds in compression.
    """
    knee, slope = (np.zeros(1), np.full(1, axial)) if law is None else hinge_table(*(np.asarray(v, float) for v in law))
    tangent = float(np.cumsum(slope).max())
    return Section(
        axial=max(axial, tangent),
        shear=5.0 / 12.0 / (1.0 + POISSON) * axial if shear is None else shear,
        torsion=bending / (1.0 + POISSON) if torsion is None else torsion,
        bending=bending,
        radius=radius,
        linear_density=linear_density,
        hinge_strain=knee,
        hinge_slope=slope,
        compression=float(slope[0]),
        offset_factor=1.0,
    )


def round_section(modulus: float, diameter: float, density: float) -> Section:
    """Solid circle: ``modulus`` [MPa], ``diameter`` [mm], ``density`` [g/mm^3]."""
    area = 0.25 * pi * diameter**2
    return section(modulus * area, modulus * pi * diameter**4 / 64.0, 0.5 * diameter, density * area)


def linear_laminate(
    membrane: tuple[float, float],
    bending: tuple[float, float],
    shear: float,
    thickness: float,
    *,
    twist: float | None = None,
    hourglass: float = 0.05,
    fail_strain: tuple[float, float] = (np.inf, np.inf),
) -> Laminate:
    """Linear laminate: ``membrane`` stiffness [N/mm] and ``bending`` stiffness [N mm] of warp and weft, ``shear``
    [N/mm].

    The outer layers lie at half the ``thickness`` [mm]; transverse shear is that of the plate, 5 D / t^2. ``twist``
    [N mm] is the energy's factor of (2 kappa_ab)^2 / 2, by default that of three equal layers of the shear stiffness,
    S t^2 / 6, twice that of a homogeneous plate, S t^2 / 12. ``hourglass`` control as a share of the fully integrated
    element. Raises :class:`InputError` for a bending stiffness that the membrane cannot have at this thickness.
    """
    stretch, bend = finite(membrane, "membrane", (2,)), finite(bending, "bending", (2,))
    if not (stretch.min() > 0.0 and bend.min() >= 0.0 and thickness > 0.0 and shear >= 0.0):
        raise InputError("expected membrane and thickness above 0, bending and shear of at least 0")
    lever = 0.5 * thickness
    outer = bend / (2.0 * lever**2)
    if (stretch <= 2.0 * outer).any():
        least = float((2.0 * np.sqrt(bend / stretch)).max())
        raise InputError(
            f"bending {bending} N mm is too much for membrane {membrane} N/mm at thickness {thickness:g} mm: the "
            f"middle layer would be negative; a thickness above {least:.4g} mm would do"
        )
    transverse = 5.0 * bend / thickness**2
    return Laminate(
        lever=lever, outer=outer, compression=stretch - 2.0 * outer, knee=np.zeros((2, 1)),
        slope=(stretch - 2.0 * outer)[:, None].copy(), shear_knee=np.zeros(1), shear_slope=np.full(1, float(shear)),
        shear_friction=0.0, shear_stick=1.0, twist=2.0 / 3.0 * shear * lever**2 if twist is None else twist,
        transverse=transverse,
        hourglass_membrane=hourglass * float(stretch.mean()) / 12.0,
        hourglass_bending=hourglass * float(bend.mean()) / 12.0,
        hourglass_transverse=hourglass * float(transverse.mean()) / 12.0,
        fail_strain=np.array(fail_strain, float),
    )  # fmt: skip
