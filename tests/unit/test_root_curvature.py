"""The curvature of a cantilever's root, read from few rows of nodes."""

import numpy as np
import pytest

from knittest.laboratory.base import Prepared
from knittest.laboratory.cantilever.mounting import Mounting
from knittest.materials.heavy_elastica import heavy_elastica

OVERHANG, WEIGHT = 171.0, 4.6e-4
STIFFNESS = WEIGHT * OVERHANG**3 / 8.0


@pytest.mark.parametrize("rows", [4, 10, 17, 34])
def test_a_coarse_strip_has_the_curvature_of_its_root_moment(rows: int) -> None:
    """M = w int x ds, kappa = M / B; from two rows three terms were read, and the stiffness came out a thousandfold."""
    arc = np.linspace(0.0, OVERHANG, 4001)
    moment = WEIGHT * np.trapezoid(heavy_elastica(arc, OVERHANG, WEIGHT, STIFFNESS)[0], arc)
    along = np.concatenate([[-OVERHANG / rows], np.linspace(0.0, OVERHANG, rows + 1)])
    reach, drop, _ = heavy_elastica(along, OVERHANG, WEIGHT, STIFFNESS)
    flat, now = (np.column_stack([0.0 * along, y, z]) for y, z in ((along, 0.0 * along), (reach, -drop)))
    assert Mounting(flat, np.zeros(len(along))).curvature(now) == pytest.approx(moment / STIFFNESS, rel=0.015)


def test_a_mount_that_only_holds_is_no_rig() -> None:
    """Nothing moves: no time passes, and nobody can simulate it by mistake."""
    held = Prepared(None, Mounting(np.zeros((2, 3)), np.zeros(2)))  # type: ignore[arg-type]
    assert held.duration == 0.0
    with pytest.raises(TypeError, match="Mounting only holds the model"):
        _ = held.rig
    assert not {"finished", "channels", "duration", "ring_time"} & set(dir(held.mount))
