"""Fields of a layer's own yarn: settings, units, assumed inputs, and what is wrong with a number of a layer."""

import pytest

from knittest.base.errors import InputError
from knittest.config.fields import field_at
from knittest.config.loading import resolve
from knittest.config.quality_checks import deciding_fields, field_value
from knittest.config.yaml_writer import dump
from knittest.experiment.origin import assumed_inputs, quantities
from knittest.report_page.parameters import quantities as listed_quantities

FIELD = "fabric.layers.0.yarn.youngs_modulus"


def carbon(**more):
    return resolve(variant="two-yarns", **more)


def test_a_setting_changes_one_layer():
    run, plain = carbon(sets=[f"{FIELD}=200", "fabric.layers.1.pattern=x."]), carbon()
    changed = run.fabric.layers[0].yarn.youngs_modulus
    assert (changed.value, changed.source) == (200, "user")
    assert run.fabric.layers[1].pattern == "x." and run.fabric.reinforcing == plain.fabric.reinforcing
    assert field_value(run, FIELD) == changed
    assert field_at(tuple(FIELD.split("."))).unit == "GPa"


def test_a_resolved_config_states_units_in_layers_and_is_read_back(tmp_path):
    run = carbon(sets=[f"{FIELD}=200"])
    path = tmp_path / "config.yaml"
    path.write_text(dump(run), encoding="utf-8")
    assert "# GPa" in path.read_text().split("layers:")[1].split("reinforcing:")[0]
    assert resolve(config=path).fabric == run.fabric


def test_missing_layers_and_wrong_values_are_named():
    with pytest.raises(InputError, match=r"fabric\.layers has 2 entries, counted from 0"):
        carbon(sets=["fabric.layers.2.pattern=x."])
    with pytest.raises(InputError, match=r"fabric\.layers is not given as a list"):
        resolve(variant="1", sets=[f"{FIELD}=200"])
    with pytest.raises(InputError, match=r"layer 1 has no yarn of its own .* set fabric\.reinforcing\.youngs_modulus"):
        carbon(sets=["fabric.layers.1.yarn.youngs_modulus=200"])
    with pytest.raises(InputError, match=r"fabric\.layers is a list; expected the number of an entry.* found 'x'"):
        carbon(sets=["fabric.layers.x.yarn.youngs_modulus=200"])
    with pytest.raises(InputError, match=r"^--set fabric\.layers\.0\.yarn\.youngs_modulus.* = -1"):
        carbon(sets=[f"{FIELD}=-1"])


def test_settings_may_give_a_layer_its_own_yarn_in_any_order():
    sets = ["youngs_modulus=70", "fibre=E-glass", "linear_density=400"]
    found = [
        carbon(sets=[f"fabric.layers.1.yarn.{one}" for one in order]).fabric.layers[1].yarn
        for order in (sets, sets[::-1])
    ]
    assert found[0] == found[1] and found[0].youngs_modulus.value == 70


def test_the_yarn_of_the_layers_along_the_load_decides():
    warp, weft = (deciding_fields(carbon(scale="meso", direction=d)) for d in ("warp", "weft"))
    assert "layers.0.yarn.youngs_modulus" in warp and "reinforcing.youngs_modulus" not in warp
    assert "reinforcing.youngs_modulus" in weft and "layers.0.yarn.youngs_modulus" not in weft
    assert "layers.0.yarn.efficiency" in assumed_inputs(carbon(scale="meso", direction="warp"))


def test_quantities_of_layers_are_listed():
    run = carbon()
    assert any(one is run.fabric.layers[0].yarn.youngs_modulus for one in quantities(run.fabric))
    paths = [path for path, _ in listed_quantities(run.model_dump(mode="json"))]
    assert tuple(FIELD.split(".")) in paths
