"""Trellis shear of a square on a hinged frame: angle, travel, and the definitions of shear force that are in use.

S [N/mm] is the force of the shear law: power S dgamma/dt per reference area, gamma the shear angle. Everything else is
converted to it by F dd = S A dgamma with the crosshead force F, d = 2 L_frame (sin(pi/4 + gamma/2) - sqrt(1/2)) and the
fabric's area A = L_fabric^2, hence F = S L_fabric^2 / (L_frame sin(pi/4 - gamma/2)). Angles in rad, lengths in mm.

- conjugate: S itself.
- normalised: F_s L_frame / L_fabric^2 with the force along a side F_s = F / (2 cos(pi/4 - gamma/2)), after Cao et al.
  (2008); it is S / cos gamma, whatever the sides.
- cauchy: shear component of the Cauchy stress times thickness, in axes along one fibre; fibres that keep their length
  carry S / cos gamma on the sides of the sheared square.
"""

from math import pi, sqrt
from typing import Any, Literal

import numpy as np

Definition = Literal["conjugate", "normalised", "cauchy"]

#: columns of a curve of shear: angle and normalised force
ANGLE, NORMALISED = "shear_angle_deg", "normalised_shear_force_n_per_mm"
#: column of the conjugate shear force
CONJUGATE = "shear_force_n_per_mm"
#: definition of the shear force by the name of its column
DEFINITIONS: dict[str, Definition] = {
    "shear_force_n_per_mm": "conjugate",
    NORMALISED: "normalised",
    "cauchy_shear_n_per_mm": "cauchy",
}


def frame_angle(displacement: float, side: float) -> float:
    """Shear angle [rad] at a crosshead displacement [mm] (Eq. 1 of Pham et al.; its sqrt(2L) is a misprint).

    >>> round(np.rad2deg(frame_angle(50.0, 150.0)).item(), 2)  # a frame with sides of 150 mm
    31.8
    """
    return pi / 2.0 - 2.0 * float(np.arccos(min((sqrt(2.0) * side + displacement) / (2.0 * side), 1.0)))


def crosshead(angle: Any, side: float) -> Any:
    """Crosshead displacement [mm] at a shear angle [rad], a number or an array: the inverse of :func:`frame_angle`.

    >>> round(crosshead(np.deg2rad(30.0), 150.0).item(), 2)
    47.68
    """
    return sqrt(2.0) * side * (np.cos(0.5 * angle) + np.sin(0.5 * angle) - 1.0)


def crosshead_force(shear: Any, angle: Any, fabric_side: float, frame_side: float) -> Any:
    """Crosshead force F [N] of the shear force S [N/mm] at ``angle``, numbers or arrays.

    >>> round(crosshead_force(0.1, np.deg2rad(30.0), 150.0, 150.0).item(), 2)  # 0.1 x 150 / sin 30 deg
    30.0
    """
    return shear * fabric_side**2 / (frame_side * np.sin(pi / 4.0 - 0.5 * np.asarray(angle)))


def normalised_force(force: Any, angle: Any, fabric_side: float, frame_side: float) -> Any:
    """Normalised shear force [N/mm] of the crosshead force ``force`` [N].

    >>> round(normalised_force(30.0, np.deg2rad(30.0), 150.0, 150.0).item(), 4)  # 0.1 / cos 30 deg
    0.1155
    """
    along_side = force / (2.0 * np.cos(pi / 4.0 - 0.5 * np.asarray(angle)))
    return along_side * frame_side / fabric_side**2


def crosshead_of_normalised(normalised: Any, angle: Any, fabric_side: float, frame_side: float) -> Any:
    """Crosshead force [N] of a normalised shear force [N/mm]: the inverse of :func:`normalised_force`."""
    return normalised / normalised_force(1.0, angle, fabric_side, frame_side)


def to_conjugate(value: Any, angle: Any, definition: Definition) -> Any:
    """S [N/mm] of a shear force by ``definition`` [N/mm].

    >>> round(to_conjugate(0.1155, np.deg2rad(30.0), "normalised").item(), 4)
    0.1
    """
    return value if definition == "conjugate" else value * np.cos(angle)
