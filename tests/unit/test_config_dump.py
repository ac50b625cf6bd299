"""The dumped run reads back equal, with units beside the numbers; templates and schema come from the models."""

import json

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from knittest.base.errors import InputError
from knittest.base.files import configs_dir
from knittest.config.loading import resolve
from knittest.config.run import Run, Solver
from knittest.config.schema import run_schema
from knittest.config.templates import copy_as_assumed, fabric_template, rig_template
from knittest.config.yaml_loader import parse_document
from knittest.config.yaml_writer import dump, dump_mapping
from knittest.laboratory.tensile.config import TensileRig


@pytest.fixture
def dumped(tmp_path):
    def write(run: Run):
        path = tmp_path / "config.yaml"
        path.write_text(dump(run), encoding="utf-8")
        return path

    return write


def test_dump_is_plain_yaml_with_the_unit_of_every_number():
    run = resolve(variant="1")
    lines = {"  gauge_length: 100.0  # mm", "    youngs_modulus:  # GPa", "  speed: 2.0  # m/s"}
    assert lines <= set(dump(run).splitlines())
    assert yaml.safe_load(dump(run))["fabric"]["loop_length"]["value"] == run.fabric.loop_length.value


@pytest.mark.parametrize("variant", ["1", "2"])
@pytest.mark.parametrize("scale", ["macro", "meso"])
def test_dump_repeats_the_run(dumped, variant, scale):
    sets = ["fabric.reinforcing.slack.warp=1e-5", "fabric.title='no: 1e3'", "solver.target_step=0.01"]
    run = resolve(variant=variant, scale=scale, preset="quick", direction="weft", seed=3, specimens=4, sets=sets)
    assert resolve(config=dumped(run)) == run


def test_dumped_run_says_when_a_preset_or_set_could_not_apply(dumped):
    path = dumped(resolve(variant="1"))
    with pytest.raises(InputError, match=r"config\.yaml:\d+: rig\.gauge_length = 100\.0 .*preset quick"):
        resolve(config=path, preset="quick")
    with pytest.raises(InputError, match="has no parameter_sets"):
        resolve(config=path, parameters="as-measured")
    with pytest.raises(InputError, match="more than one fabric"):
        resolve(config=path, variant="2")


UNREAD = "\u2028\u2029\x85\ufeff\ufffe\uffff"  # line breaks of YAML, and no characters
TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=["Cc", "Cs"], exclude_characters=UNREAD))
NUMBERS = st.integers(-(10**17), 10**17) | st.floats(allow_nan=False, allow_infinity=False)
VALUES = TEXTS | NUMBERS | st.booleans() | st.none()
KEYS = st.from_regex(r"[a-z]{1,8}", fullmatch=True).filter(lambda key: key not in ("null", "true", "false"))


@settings(deadline=2000)
@given(st.dictionaries(KEYS, VALUES))
def test_any_value_survives_dump_and_load(data):
    text = dump_mapping(data) if data else "{}"
    assert parse_document(text, "f.yaml").data == data


@pytest.mark.parametrize(
    "text", ["1e3", "012", "no", "12:30", "null", "", "~", "0o17", ".5", "- a", "a: b", "# c", "<<"]
)
def test_text_that_looks_like_something_else_stays_text(text):
    assert parse_document(dump_mapping({"a": text}), "f.yaml").data == {"a": text}


def test_shipped_rig_file_is_the_template_and_states_the_defaults():
    text = (configs_dir() / "rigs" / "tensile.yaml").read_text(encoding="utf-8")
    assert text == rig_template()
    stated = parse_document(text, "tensile.yaml").data
    assert Solver.model_validate(stated["solver"]) == Solver.model_validate({})
    assert TensileRig.model_validate(stated["rig"]) == TensileRig.model_validate({})
    assert {"direction", "gauge_length"}.isdisjoint(stated["rig"])  # both left to options and preset


def test_fabric_template_is_a_fabric_that_claims_nothing(tmp_path):
    like = resolve(variant="2", parameters="as-measured").fabric
    path = tmp_path / "mine.yaml"
    path.write_text(fabric_template(copy_as_assumed(like, "mine"), like.name), encoding="utf-8")
    fabric = resolve(fabric=path).fabric
    assert (fabric.name, fabric.experiment) == ("mine", None)
    assert fabric.loop_length.value == like.loop_length.value
    assert fabric.loop_length.source == fabric.reinforcing.crimp.weft.source == "assumed"
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    assert not any(word in "\n".join(lines) for word in ("source: measured", "source: tuned", "source: derived"))


def test_the_parameter_sets_that_the_fabric_template_proposes_work(tmp_path):
    like = resolve(variant="2", parameters="as-measured").fabric
    text = fabric_template(copy_as_assumed(like, "mine"), like.name)
    path = tmp_path / "mine.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="has no parameter_sets: leave out --parameters"):
        resolve(fabric=path, parameters="calibrated")
    proposed = [line.removeprefix("#   ") for line in text.splitlines() if line.startswith("#   ")]
    sets = proposed[proposed.index("parameter_sets:") :]
    path.write_text(text + "\n".join(sets), encoding="utf-8")
    assert resolve(fabric=path).fabric.reinforcing.youngs_modulus.source == "tuned"
    assert resolve(fabric=path, parameters="as-measured").fabric.reinforcing.youngs_modulus.source == "assumed"


def test_schema_states_units_and_bounds_of_every_number():
    schema = run_schema()
    width = schema["$defs"]["TensileRig"]["properties"]["width"]
    assert (width["unit"], width["exclusiveMinimum"]) == ("mm", 0)
    assert schema["$defs"]["KnittingYarn"]["properties"]["load_area"]["unit"] == "mm2"
    assert {"type": "number"} in schema["$defs"]["Quantity"]["anyOf"]
    assert not {'"gt":', '"ge":', '"le":'} & set(json.dumps(schema).split())
