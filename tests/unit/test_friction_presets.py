"""A strip of yarns in the friction test is narrower than the paper's and under the same pressure."""

import pytest

from knittest.config.loading import resolve


def force(*sets: str, scale: str = "meso", preset: str = "quick") -> float:
    """Normal force [N] of a run."""
    return float(resolve(test="friction", variant="1", scale=scale, preset=preset, sets=list(sets)).rig.normal_force)


@pytest.mark.parametrize(("preset", "width"), [("quick", 15.0), ("standard", 25.0), ("paper", 50.0)])
def test_the_force_over_the_width_is_that_of_the_paper(preset: str, width: float) -> None:
    assert force(preset=preset) == pytest.approx(2000.0 / 50.0 * width)


def test_the_force_follows_a_stated_width() -> None:
    assert force("rig.width=30") == pytest.approx(1200.0)


def test_a_stated_force_counts_at_any_width() -> None:
    assert force("rig.normal_force=700", "rig.width=30") == 700.0


def test_shells_are_as_wide_as_the_strip_of_the_paper() -> None:
    assert force(scale="macro") == 2000.0
