"""A compressed net of shells folds into bands of shear whose width and force do not depend on the mesh.

A net between two clamps a length L apart, compressed along its warp and free to move in its plane across it, buckles
at N = S + B (2 pi / L)^2 with its shear stiffness S and the bending stiffness B of its warp in the plane (Euler), into
two bands of opposite shear, each half a length wide. Without B every wave has the same force S, and the mesh decides
the width of the bands.
"""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.base import fabric_laminate
from knittest.materials.laminate import limit_membrane
from knittest.pose import ALL, Body, Table

LENGTH, WIDTH, TIME, SHORTER = 48.0, 12.0, 60.0, 1.0
#: largest offset of a weft from the line of the warp [mm]
UNEVEN = 0.02


def compressed(size: float, *sets: str) -> tuple[float, np.ndarray, tuple[float, float]]:
    """Force per width [N/mm], shear angle along the net [deg], and S and B of the forming test of variant 1."""
    run = resolve(test="forming", variant="1", scale="macro", preset="quick", sets=sets)
    law = limit_membrane(fabric_laminate(run), run.rig.membrane_share)
    columns, rows = round(LENGTH / size) + 2, round(WIDTH / size)
    x, y = size * (np.arange(columns + 1) - 1.0), size * np.arange(rows + 1)
    across = np.random.default_rng(1).uniform(-UNEVEN, UNEVEN, len(x)) * ((x > 0.0) & (x < LENGTH))
    points = np.array([[a, b + shift, 0.0] for a, shift in zip(x, across, strict=True) for b in y])
    node = np.arange(points.shape[0]).reshape(columns + 1, rows + 1)
    cells = np.stack([node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:]], axis=-1).reshape(-1, 4)
    fabric = run.fabric
    body = Body.of_shells(
        points, cells, law, fabric.area_mass_g_per_mm2, fabric.thickness_mm, (1.0, 0.0, 0.0), threads=1, damping=0.2
    )
    held, driven = node[x <= 0.0].ravel(), node[x >= LENGTH].ravel()
    body.boundary.move(held, ALL)
    speed = Table((0.0, 0.5 * TIME, TIME), (0.0, -2.0 * SHORTER / TIME, 0.0))
    group = body.boundary.move(driven, "x", speed)
    body.boundary.move(driven, [dof for dof in ALL if dof != "x"])
    body.boundary.move(np.setdiff1d(node, [*held, *driven]), ("z", "rx", "ry"))
    body.advance(TIME + 20.0)
    angle = np.rad2deg(body.fields()["shear_angle"]).reshape(columns, rows).mean(axis=1)[1:-1]
    return -body.reaction(group) / WIDTH, angle, (float(law.shear_slope[0]), float(law.in_plane[0]))


def band_width(angle: np.ndarray) -> float:
    """Length [mm] over the number of stretches of one sign, those below 2 deg left out."""
    sign = np.sign(np.where(np.abs(angle) < 2.0, 0.0, angle))
    sign = sign[sign != 0.0]
    return LENGTH / (1 + np.count_nonzero(np.diff(sign)))


def test_bands_and_force_of_a_compressed_net_do_not_depend_on_the_mesh():
    """The clamps hold the slope half a shell outside the free length: L + h."""
    for size in (6.0, 3.0):
        force, angle, (shear, bending) = compressed(size)
        assert band_width(angle) == pytest.approx(0.5 * LENGTH)
        # the law of shear softens by 8 % beyond 9 deg, which the band reaches
        assert force == pytest.approx(shear + bending * (2.0 * np.pi / (LENGTH + size)) ** 2, rel=0.04)


def test_without_bending_in_the_plane_the_mesh_decides_and_the_force_is_that_of_shear():
    narrow = [compressed(size, "rig.in_plane_bending=false") for size in (6.0, 3.0)]
    for force, angle, (shear, bending) in narrow:
        assert bending == 0.0 and force == pytest.approx(shear, rel=0.05)
        assert band_width(angle) < 0.3 * LENGTH
        assert np.abs(np.diff(angle)).max() > 20.0
