"""A frame of shells whose largest angle nobody stated ends where the law of its fabric does."""

from typing import Any

import pytest

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.laboratory.law_end import ends_with_its_law
from knittest.runs.specimen import prepare

SHORT = ("fabric.macro.shear.curve=null", "fabric.macro.shear.points=[[0, 0], [20, 0.01], [33.37, 0.03]]")


def frame(*sets: str, test: str = "picture-frame", **more: Any) -> Any:
    return resolve(test=test, variant="1", scale="macro", preset="quick", sets=[*SHORT, *sets], **more)


@pytest.mark.parametrize("test", ["picture-frame", "bias-extension"])
def test_a_run_without_an_end_takes_that_of_its_law(test: str) -> None:
    run, said = ends_with_its_law(frame(test=test))
    assert run.rig.max_angle == 33.3  # type: ignore[attr-defined]
    assert said == "rig.max_angle = 33.3 deg instead of the default 45 deg, because macro.shear ends there"
    prepare(run)


def test_a_stated_end_stays_and_is_refused() -> None:
    stated = frame("rig.max_angle=45")
    assert ends_with_its_law(stated) == (stated, "")
    with pytest.raises(InputError, match=r"--set rig\.max_angle=33\.3"):
        prepare(stated)


def test_turns_beyond_the_law_are_refused() -> None:
    run = frame("rig.turns=[40, 10]")
    assert ends_with_its_law(run) == (run, "")
    with pytest.raises(InputError, match=r"--set rig\.max_angle=33\.3"):
        prepare(run)


def test_a_law_of_no_angle_leaves_the_run_as_it_is() -> None:
    points = "fabric.macro.shear.points=[[0, 0], [0.04, 0.01], [0.05, 0.03]]"
    run = resolve(test="picture-frame", variant="1", scale="macro", preset="quick", sets=[SHORT[0], points])
    assert ends_with_its_law(run) == (run, "")


def test_a_law_that_goes_on_changes_nothing() -> None:
    shipped = resolve(test="picture-frame", variant="1", scale="macro", preset="quick")
    assert ends_with_its_law(shipped) == (shipped, "")


@pytest.mark.parametrize(("test", "scale"), [("tensile", "macro"), ("picture-frame", "meso")])
def test_other_runs_have_no_law_that_ends_them(test: str, scale: str) -> None:
    run = resolve(test=test, variant="1", scale=scale, preset="quick", direction="warp" if test == "tensile" else None)
    assert ends_with_its_law(run) == (run, "")
