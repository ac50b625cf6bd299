"""Contact between yarns follows from the yarn of the loops where a fabric does not state it."""

from typing import Any

import pytest
import yaml
from pydantic import ValidationError

from knittest.base.files import configs_dir
from knittest.config.fabric import Fabric
from knittest.config.loading import resolve
from knittest.config.templates import new_fabric_text
from knittest.runs.preflight.yarn_counterparts import derived_lines


def document() -> dict[str, Any]:
    """Variant 1 with cards of yarns."""
    found: dict[str, Any] = yaml.safe_load((configs_dir() / "fabrics" / "pham2019-v1.yaml").read_text())
    del found["parameter_sets"]
    found["knitting"] = {"fibre": "polyester", "linear_density": 68}
    return found


def fabric(**contact: Any) -> Fabric:
    return Fabric.model_validate(document() | {"contact": contact})


def test_the_breaking_force_of_the_loops_presses_a_contact_in_by_their_radius() -> None:
    made = fabric()
    loop, stiffness = made.knitting, made.contact.normal_stiffness
    force = 8.6e3 * 0.13 * 68e-3 / 1.38  # modulus x failure strain x area of the fibres
    assert stiffness.value == pytest.approx(force / (0.5 * loop.beam_diameter.value), rel=1e-3)
    assert stiffness.source == "derived" and "breaking force 55.09 N" in stiffness.ref
    assert (made.contact.friction_coefficient.value, made.contact.tangential_ratio.value) == (0.3, 0.1)
    assert made.contact.friction_coefficient.source == made.contact.tangential_ratio.source == "assumed"


def test_a_fabric_has_a_contact_where_it_has_yarns_and_stated_numbers_stay() -> None:
    without = {name: entry for name, entry in document().items() if name != "contact"}
    assert Fabric.model_validate(without).contact == fabric().contact
    none = {name: entry for name, entry in without.items() if name not in ("loop_length", "reinforcing", "knitting")}
    assert Fabric.model_validate(none).contact is None
    stated = fabric(normal_stiffness=500, friction_coefficient=0.2)
    assert (stated.contact.normal_stiffness.value, stated.contact.friction_coefficient.value) == (500.0, 0.2)
    shipped = resolve(test="tensile", variant="1", scale="meso", preset="quick").fabric.contact
    assert (shipped.normal_stiffness.value, shipped.normal_stiffness.source) == (1000.0, "assumed")


def test_check_lists_assumed_numbers_only_where_some_were_filled_in() -> None:
    lines = derived_lines(started())
    assert [line.split(":")[0].strip() for line in lines] == ["derived from the yarns", "contact.normal_stiffness"]
    assert derived_lines(started("polyester 68 tex"))[-1].startswith("  assumed: knitting.packing 0.6")


def test_it_is_derived_again_when_the_yarn_changes() -> None:
    again = fabric().model_dump() | {"knitting": {"fibre": "polyester", "linear_density": 136}}
    # the force goes with the linear density, the radius with its square root
    stiffness = Fabric.model_validate(again).contact.normal_stiffness.value
    assert stiffness == pytest.approx(2.0**0.5 * fabric().contact.normal_stiffness.value)


@pytest.mark.parametrize(("contact", "least"), [({}, 100.0), ({"tangential_ratio": 0.02}, 500.0)])
def test_weak_loops_have_the_least_stiffness_that_rubs(contact: dict[str, float], least: float) -> None:
    weak = document() | {"knitting": {"fibre": "acrylic", "linear_density": 20}, "contact": contact}
    assert Fabric.model_validate(weak).contact.normal_stiffness.value == least


@pytest.mark.parametrize("contact", [5, False, 0, [], ""])
def test_what_is_no_contact_is_refused(contact: object) -> None:
    with pytest.raises(ValidationError):
        Fabric.model_validate(document() | {"contact": contact})


def started(*yarns: str, **contact: float) -> Fabric:
    """A fabric that is started from variant 1 with a ``contact``, measured, and yarns of the loops."""
    like = resolve(variant="1", parameters="as-measured").fabric
    made = {name: {"value": value, "source": "measured"} for name, value in contact.items()}
    own = Fabric.model_validate(like.model_dump() | {"contact": like.contact.model_dump() | made})
    text = new_fabric_text("mine", own, yarns=dict.fromkeys(["knitting"], yarns[0]) if yarns else None)
    return Fabric.model_validate(yaml.safe_load(text))


def test_a_new_fabric_follows_the_yarn_of_its_loops_unless_both_were_measured() -> None:
    assert started().contact.normal_stiffness.source == "derived"
    assert started("polyester 68 tex").contact.normal_stiffness.value == pytest.approx(340.73, rel=1e-4)
    assert started(normal_stiffness=5000.0).contact.normal_stiffness.value == 5000.0
    assert started("polyester 68 tex", normal_stiffness=5000.0).contact.normal_stiffness.source == "derived"
    weak = started("polyester 34 tex", tangential_ratio=0.01).contact
    assert weak.normal_stiffness.value == 1000.0 and "at least 1000 N/mm" in weak.normal_stiffness.ref
