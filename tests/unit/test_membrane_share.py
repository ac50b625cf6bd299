"""A fabric that bends too stiffly for the default share of membrane stiffness has what is enough, and is told."""

from typing import Any

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.base.history import History, Quality
from knittest.config.dumping import dump
from knittest.config.loading import resolve
from knittest.laboratory.base import Prepared, fabric_laminate
from knittest.laboratory.cantilever.test import Cantilever
from knittest.materials.laminate import enough_for_bending, softened
from knittest.solve.state import SimulationCost

STIFF = "fabric.macro.bending_stiffness.warp=200"


def prepared(*sets: str) -> tuple[Any, Prepared]:
    run = resolve(test="cantilever", scale="macro", preset="quick", variant="1", direction="warp", sets=list(sets))
    return run, Cantilever().prepare(run)


def judged(run: Any, mounted: Prepared, hourglass: float = 0.0) -> Quality:
    """A strip at rest, its hourglass over its internal energy."""
    last = {"root_moment_nmm": 1.0, "weight_moment_nmm": 1.0, "converged": 1.0, "drift_deg": 0.0, "steps": 9.0} | {
        "hourglass_over_internal": hourglass
    }
    energies = {name: np.array([value]) for name, value in last.items()}
    return Cantilever().assess(run, mounted, History(mounted.model.mesh, {}, energies, []), SimulationCost())


def warned(run: Any, mounted: Prepared) -> tuple[str, ...]:
    """Warnings on a strip at rest that no gate refuses."""
    quality = judged(run, mounted)
    assert not quality.failures
    return quality.warnings


def test_a_shipped_fabric_keeps_the_default_to_the_bit() -> None:
    run, mounted = prepared()
    assert mounted.facts["membrane_share"] == 0.01 and not warned(run, mounted)


def test_a_stiff_fabric_takes_what_is_enough_and_says_so() -> None:
    run, mounted = prepared(STIFF)
    share = mounted.facts["membrane_share"]
    card = fabric_laminate(run)
    assert (softened(card, share).slope > 0.0).all()
    with pytest.raises(InputError, match="leaves less membrane stiffness"):
        softened(card, 0.75 * share)  # hardly more than is needed
    (told,) = warned(run, mounted)
    assert f"rig.membrane_share: {share:g} is kept" in told and "0.01" in told


def test_a_share_that_is_chosen_is_refused_where_it_is_too_small_and_kept_where_not() -> None:
    for share in ("0.01", "0.011"):  # the usual one as well, where it is chosen
        with pytest.raises(InputError, match="leaves enough"):
            prepared(STIFF, f"rig.membrane_share={share}")
    run, mounted = prepared(STIFF, "rig.membrane_share=0.5")
    assert mounted.facts["membrane_share"] == 0.5 and not warned(run, mounted)


def test_a_run_that_goes_on_from_its_folder_keeps_who_chose(tmp_path: Any) -> None:
    for sets, chosen in (((), None), (("rig.membrane_share=0.01",), 0.01)):
        path = tmp_path / "config.yaml"
        path.write_text(dump(prepared(*sets)[0]))
        assert resolve(config=path).rig.membrane_share == chosen


def test_enough_is_what_is_kept_unless_bending_needs_more() -> None:
    card = fabric_laminate(prepared()[0])
    least = float((2.0 * card.outer / (card.slope[:, 0] + 2.0 * card.outer)).max())
    assert enough_for_bending(card, 1.01 * least) == 1.01 * least
    assert 1.2 * least <= enough_for_bending(card, 0.99 * least) <= 1.2 * least + 0.01


@pytest.mark.parametrize(
    ("share", "failures", "warnings"), [(0.024, 0, 0), (0.026, 0, 1), (0.051, 1, 0), (np.nan, 1, 0)]
)
def test_hourglass_energy_of_a_strip_at_rest_is_judged(share: float, failures: int, warnings: int) -> None:
    quality = judged(*prepared(), share)
    assert (len(quality.failures), len(quality.warnings)) == (failures, warnings)
    told = [*quality.failures, *quality.warnings]
    assert all(text.startswith("hourglass energy over internal energy") for text in told)
    assert "model.macro.element_size" in "".join(quality.failures) or share != 0.051
    assert quality.hourglass_over_internal_max == pytest.approx(share, nan_ok=True)
