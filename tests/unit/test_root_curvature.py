"""The curvature of a cantilever's root, read from few rows of nodes."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.base import Prepared
from knittest.laboratory.cantilever.shells import Mounting, mount_shells, root_curvature
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
    with pytest.raises(TypeError, match="Mounting is a holder"):
        _ = held.rig
    assert not {"finished", "channels", "duration", "ring_time"} & set(dir(held.mount))


@pytest.mark.parametrize("rows", [4, 10, 17, 34])
def test_a_coarse_strip_of_shells_has_it_from_the_turns_of_its_rows(rows: int) -> None:
    """From the deflection, which shear and the rows' chords add to, it was 5 to 12 % too small."""
    arc = np.linspace(0.0, OVERHANG, 4001)
    moment = WEIGHT * np.trapezoid(heavy_elastica(arc, OVERHANG, WEIGHT, STIFFNESS)[0], arc)
    along = np.repeat(np.concatenate([[-OVERHANG / rows], np.linspace(0.0, OVERHANG, rows + 1)]), 2)
    turns = np.where(along > 0.0, heavy_elastica(along, OVERHANG, WEIGHT, STIFFNESS)[2], 0.0)
    assert root_curvature(along, turns) == pytest.approx(moment / STIFFNESS, rel=0.015)


def test_shells_of_a_short_overhang_are_no_longer_across_than_along() -> None:
    """Four rows over 10 mm of shells 10 mm across: the chord came out 27 % too steep, the stiffness 62 % too small."""
    sets = ["rig.overhang=10", "model.macro.element_size=10"]
    run = resolve(test="cantilever", variant="1", scale="macro", preset="quick", direction="warp", sets=sets)
    place = mount_shells(run, 10.0).model.position()
    across, along = (np.diff(np.unique(np.round(place[:, k], 6))).max() for k in (0, 1))
    assert along == pytest.approx(2.5) and across <= along * 1.01
