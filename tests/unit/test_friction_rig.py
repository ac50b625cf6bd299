"""Friction test: its floating plate loses nothing, and its normal force follows the width and the fabric's own test."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from knittest.base.history import Quality
from knittest.config.loading import resolve
from knittest.config.templates import new_fabric_text
from knittest.kernels.tool_contact import FREE
from knittest.laboratory.fabric_test import FabricTest
from knittest.laboratory.friction.rig import FrictionTest
from knittest.laboratory.friction.test import Friction
from knittest.models.boundary import Boundary
from knittest.runs.specimen import prepare


@pytest.mark.parametrize("variant", ["1", "2"])
def test_the_floating_plate_has_no_drag(variant: str) -> None:
    """Closed form for a linear fabric: drag c of a plate of mass M loses 20/7 c M d / (F T) of the pressing work.

    That was 5 to 9 % of the work of variant 1 with c = 50/ms, F = 2000 N, T = 1 ms, d = 0.3 to 0.36 mm, M = 2.7 g.
    """
    run = resolve(test="friction", variant=variant, scale="macro", direction="warp", preset="quick")
    prepared = Friction().prepare(run)
    assert isinstance(prepared.rig, FrictionTest)
    boundary = Boundary(prepared.model, 1e-3)
    prepared.rig.constrain(boundary)
    (upper,) = [tool for tool in boundary.tools if FREE in tool.motion]
    assert upper.drag == 0.0
    assert np.isclose(upper.mass, prepared.model.mass.sum(), rtol=0.1)


@pytest.mark.parametrize(
    ("sets", "more", "expected"),
    [
        ((), {}, 600.0), ((), {"preset": "standard"}, 1000.0), ((), {"preset": "paper"}, 2000.0),
        ((), {"scale": "macro"}, 2000.0), (("rig.width=30",), {}, 1200.0),
        (("rig.normal_force=700", "rig.width=30"), {}, 700.0),
    ],
)  # fmt: skip
def test_the_force_over_the_width_is_that_of_the_paper_unless_it_is_stated(
    sets: tuple[str, ...], more: dict[str, str], expected: float
) -> None:
    asked = {"variant": "1", "scale": "meso", "preset": "quick"} | more
    assert resolve(test="friction", **asked, sets=list(sets)).rig.normal_force == pytest.approx(expected)


@pytest.mark.parametrize("scale", ["meso", "macro"])
def test_the_force_of_the_fabrics_own_test_counts(scale: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    start = new_fabric_text("mine", resolve(variant="1", parameters="as-measured").fabric)
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


@pytest.mark.parametrize(("pull", "passes"), [(1.0, False), (89.0, True)])
def test_a_strip_that_stretches_between_the_plates_is_no_friction_test(
    pull: float, passes: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two faces with 0.075 under 600 N: 90 N."""
    found = {
        "pull_force_kinetic_n": pull, "normal_force_error_pct": 0.1, "penetration_over_deformation_pct": 1.0
    }  # fmt: skip
    monkeypatch.setattr(FabricTest, "assess", lambda *_: Quality(0.0, 0.0, 0.0, 0.0, 0.0, True, ()))
    monkeypatch.setattr(Friction, "results", lambda *_: found)
    run: Any = resolve(test="friction", variant="1", scale="meso", preset="quick")
    nothing: Any = None
    quality = Friction().assess(run, nothing, nothing, nothing)
    assert (not quality.failures) == passes
    if not passes:
        (text,) = quality.failures
        assert text.startswith(
            "the strip stretches instead of sliding: its pull force is 1 N, that of Coulomb's law 90 N"
        )
