"""Constants of a yarn's section from its card."""

import pytest

from knittest.config.loading import resolve
from knittest.materials.yarn_section import POISSON, Section, sections


def cards(*sets: str) -> tuple[Section, ...]:
    run = resolve(variant="1", scale="meso", preset="quick", test="picture-frame", direction=None, sets=sets)
    return sections(run.fabric)


@pytest.mark.parametrize(("yarn", "changed"), [("reinforcing", {0, 1}), ("knitting", {2})])
def test_torsion_is_that_of_a_solid_yarn_unless_the_card_says_how_it_goes_with_bending(yarn, changed):
    told = cards(f"fabric.{yarn}.torsion_ratio=0.2")
    for number, solid in enumerate(cards()):
        ratio = 0.2 if number in changed else 1.0 / (1.0 + POISSON)
        assert told[number].torsion == pytest.approx(ratio * solid.bending, rel=1e-12)
        assert (told[number].bending, told[number].axial) == (solid.bending, solid.axial)
