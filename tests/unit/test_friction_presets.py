"""A strip of yarns in the friction test is narrower than the paper's and under the same pressure."""

from pathlib import Path

import pytest

from knittest.config.loading import resolve
from knittest.config.starting import starting_text
from knittest.runs.specimen import prepare


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


@pytest.mark.parametrize("scale", ["meso", "macro"])
def test_the_force_of_the_fabrics_own_test_counts(scale: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    start = starting_text("mine", resolve(variant="1", parameters="as-measured").fabric)
    file.write_text(f"{start}rigs: {{friction: {{normal_force: 500, width: 40}}}}\n".replace("rigs: {}\n", "", 1))
    rig = resolve(test="friction", fabric=file, scale=scale, preset="quick").rig
    assert rig.normal_force == 500.0  # type: ignore[attr-defined]
    assert rig.width == {"meso": 15.0, "macro": 40.0}[scale], "a size that the preset gives to yarns stays"  # type: ignore[attr-defined]


def test_a_quarter_of_the_axial_stiffness_takes_half_as_many_steps() -> None:
    """Steps go with the root of the stiffness where that of the inlays decides."""
    sets = ("rig.width=11", "rig.length=40", "rig.plate_length=18", "rig.travel=1")
    usual, whole = (
        prepare(
            resolve(test="friction", variant="1", scale="meso", preset="quick", direction="warp", sets=[*sets, *more])
        )
        for more in ((), ("rig.membrane_share=1",))
    )
    assert usual.model.critical_step / whole.model.critical_step == pytest.approx(2.0, rel=0.02)
