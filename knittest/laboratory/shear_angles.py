"""Shear angle of the material over that of the frame which shears it: mean and scatter."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Frame, Mesh

Array = NDArray[np.float64]

#: share of the material between the bounds of the scatter [%]
BOUNDS = (5.0, 95.0)


@dataclass(frozen=True)
class AngleScatter:
    """Mean, standard deviation and bounds of the middle 90 % of a field of shear angles [deg]."""

    mean: float
    sd: float
    low: float
    high: float


def angle_scatter(angle: Array) -> AngleScatter:
    """Scatter of shear angles ``angle`` [rad], (n,), one for each equal piece of the material (shell or crossing)."""
    degrees = np.rad2deg(angle)
    low, high = np.percentile(degrees, BOUNDS)
    return AngleScatter(float(degrees.mean()), float(degrees.std()), float(low), float(high))


def shell_angles(frame: Frame) -> Array:
    """Shear angle [rad] of each shell of a picture frame, positive where the frame's is; (n_el,).

    Warp and weft lie at +-45 deg to the pulled diagonal, which closes the angle between warp and minus weft.
    """
    return -frame.fields["shear_angle"]


def crossing_angles(mesh: Mesh, frame: Frame) -> tuple[Array, Array]:
    """Shear angle [rad] at each crossing of warp and weft, (n,), and its place [mm], (n, 2); signed as the frame's.

    Directions are those of the pieces of both yarns, one pitch long, that cross there.
    """
    warp, weft = (pieces(mesh, frame, s) for s in ("warp", "weft"))
    across = weft[0].transpose(1, 0, 2)
    cosine = np.sum(warp[0] * across, axis=2)
    cosine /= np.linalg.norm(warp[0], axis=2) * np.linalg.norm(across, axis=2)
    return np.arcsin(cosine).ravel(), warp[1][..., :2].reshape(-1, 2)


def pieces(mesh: Mesh, frame: Frame, system: str) -> tuple[Array, Array]:
    """Direction and middle of each pitch of all yarns of a system, both (n_yarns, n_pitches, 3) [mm]."""
    parts = {s: np.unique(mesh.yarn[mesh.part == mesh.part_names.index(s)]) for s in ("warp", "weft")}
    pitches = len(parts["weft" if system == "warp" else "warp"])
    cells = np.array([mesh.cells[mesh.yarn == yarn] for yarn in parts[system]])
    node = np.concatenate([cells[..., 0], cells[:, -1:, 1]], axis=1)
    ends = frame.position[node[:, :: (node.shape[1] - 1) // pitches]]
    return ends[:, 1:] - ends[:, :-1], 0.5 * (ends[:, 1:] + ends[:, :-1])


def angle_table(rows: Iterable[tuple[float, AngleScatter]]) -> dict[str, Array]:
    """Columns of shear-angle.csv from the frame's angles [deg] and the scatter of the material's."""
    values = np.array([(frame, s.mean, s.sd, s.low, s.high) for frame, s in rows]).reshape(-1, 5)
    names = ("frame_shear_angle_deg", "mean_deg", "sd_deg", "percentile_5_deg", "percentile_95_deg")
    return dict(zip(names, values.T, strict=True))
