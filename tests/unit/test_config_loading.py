"""Precedence of fabric file, config file, preset, options and ``--set``."""

import pytest

from knittest.base.errors import InputError
from knittest.base.files import configs_dir
from knittest.config.loading import resolve, resolve_directions
from knittest.config.presets import PRESETS
from knittest.config.settings import Layers
from knittest.laboratory.tensile.config import GAUGE


@pytest.fixture
def rig(tmp_path):
    def write(text):
        path = tmp_path / "rig.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize("preset", list(PRESETS))
def test_preset_sets_counts_and_the_meso_gauge(preset):
    meso, macro = (resolve(variant="2", scale=scale, preset=preset) for scale in ("meso", "macro"))
    assert meso.model.meso.elements_per_loop == 30
    assert meso.model.meso.elements_per_wave == 8
    assert meso.rig.gauge_length == GAUGE[preset]
    assert macro.model.macro.element_size == PRESETS[preset]
    assert macro.rig.gauge_length == 200.0
    assert meso.model.preset == macro.model.preset == preset


def test_each_layer_goes_over_the_one_before(rig):
    config = rig("rig: {gauge_length: 80, width: 30}\nvariability: {seed: 7}\n")
    run = resolve(variant="1", config=config, preset="quick", seed=9, sets=["rig.width=25", "rig.width=20"])
    assert (run.rig.gauge_length, run.rig.width, run.variability.seed) == (80.0, 20.0, 9)


@pytest.mark.parametrize(
    ("preset", "ramp", "stamp"), [("quick", 2.0, 0.2), ("standard", 2.0, 0.5), ("paper", 4.0, 0.5)]
)
def test_preset_sets_the_speeds_of_yarns_and_an_option_goes_over_them(preset, ramp, stamp):
    solver = resolve(variant="1", scale="meso", test="picture-frame", preset=preset).solver
    assert (solver.speed, solver.ramp) == (3.0, ramp)
    assert resolve(variant="1", scale="meso", test="forming", preset=preset).solver.speed == stamp
    assert (
        resolve(variant="1", scale="meso", test="forming", preset=preset, sets=["solver.speed=1"]).solver.speed == 1.0
    )
    assert resolve(variant="1", scale="macro", test="picture-frame", preset=preset).solver.speed == 0.5


def test_config_chooses_scale_preset_and_parameters(rig):
    run = resolve(variant="2", config=rig("model: {scale: macro, preset: quick}\nparameters: as-measured\n"))
    assert run.model.macro.element_size == PRESETS["quick"]
    assert run.rig.gauge_length == 200.0
    assert run.fabric.reinforcing.youngs_modulus.source == "measured"


def test_layers_merge_mappings_but_replace_quantities_and_know_where_from():
    layers = Layers()
    layers.lay({"a": {"value": 1, "sd": 2, "ref": "Table 1"}, "b": {"c": 1, "d": 2}}, lambda _: "base:1")
    layers.lay({"a": {"value": 3}, "b": {"c": 4}}, lambda _: "over:9")
    assert layers.data == {"a": {"value": 3}, "b": {"c": 4, "d": 2}}
    assert layers.place_of(("a", "sd")) == layers.place_of(("b", "c")) == "over:9"
    assert layers.place_of(("b", "d")) == "base:1"


def test_fabric_without_sets_is_its_base(tmp_path):
    text = (configs_dir() / "fabrics" / "pham2019-v1.yaml").read_text(encoding="utf-8")
    path = tmp_path / "own.yaml"
    path.write_text(text[: text.index("parameter_sets:")], encoding="utf-8")
    assert resolve(fabric=path).parameters == "base"
    with pytest.raises(InputError, match=r"own\.yaml:\d+: --parameters calibrated: the fabric has no parameter_sets"):
        resolve(fabric=path, parameters="calibrated")


def test_set_number_is_the_users_and_keeps_the_stated_scatter():
    own = ["fabric.reinforcing.fracture_strain=1.2", "fabric.reinforcing.youngs_modulus=60"]
    yarn, calibrated, measured = (
        resolve(variant="1", **more).fabric.reinforcing for more in ({"sets": own}, {}, {"parameters": "as-measured"})
    )
    assert (calibrated.youngs_modulus.source, measured.youngs_modulus.source) == ("tuned", "measured")
    assert calibrated.youngs_modulus.ref != measured.youngs_modulus.ref
    modulus, strain = yarn.youngs_modulus, yarn.fracture_strain
    assert (modulus.value, modulus.source, modulus.tuned_on) == (60.0, "user", [])
    assert (strain.value, strain.sd, strain.source) == (1.2, 0.15, "user")
    assert "1.0 (measured)" in strain.ref
    scatter = resolve(variant="1", sets=["fabric.reinforcing.fracture_strain.sd=0"]).fabric.reinforcing.fracture_strain
    assert (scatter.value, scatter.sd, scatter.source) == (1.0, 0.0, "user")


def test_numbered_and_local_variants(tmp_path, monkeypatch):
    assert resolve(variant="1") == resolve(variant="pham2019-v1")
    text = (configs_dir() / "fabrics" / "pham2019-v1.yaml").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    for folder, name in ((tmp_path / "configs", "here"), (tmp_path / "configs" / "fabrics", "there")):
        folder.mkdir()
        (folder / f"{name}.yaml").write_text(
            text.replace("pham2019-v1", name, 1).replace("name: pham2019-v1", f"name: {name}")
        )
        assert resolve(variant=name).fabric.warp_density.value == 28.0
    with pytest.raises(InputError, match='did you mean "there"'):
        resolve(variant="thre")


def test_curve_beside_the_fabric_file_becomes_absolute(tmp_path):
    text = (configs_dir() / "fabrics" / "pham2019-v1.yaml").read_text(encoding="utf-8")
    path = tmp_path / "own.yaml"
    path.write_text(text.replace("pham2019/curves/tensile-v1-warp.csv", "mine.csv"), encoding="utf-8")
    with pytest.raises(InputError, match=r"mine\.csv.*no such file"):
        resolve(fabric=path, scale="macro")
    (tmp_path / "mine.csv").write_text("strain_pct,force_n\n0,0\n1,100\n")
    tension = resolve(fabric=path, scale="macro").fabric.macro.tension
    assert tension == {"warp": str(tmp_path / "mine.csv"), "weft": "pham2019/curves/tensile-v1-weft.csv"}


@pytest.mark.parametrize(
    ("asked", "phrase"),
    [
        ({}, "no fabric is given"),
        ({"variant": "1", "fabric": "x.yaml"}, "more than one fabric is given, --variant 1 and --fabric x.yaml"),
        ({"variant": "1", "scale": "meso", "sets": ["model.scale=macro"]}, "contradicts --scale meso"),
        ({"variant": "1", "parameters": "as-mesured"}, 'did you mean "as-measured"'),
        ({"variant": "1", "preset": "papier"}, 'did you mean "paper"'),
    ],
)
def test_contradictions_and_misses_are_refused(asked, phrase):
    with pytest.raises(InputError, match=phrase):
        resolve(**asked)
    with pytest.raises(TypeError, match="unexpected arguments: scales"):
        resolve(variant="2", scales="macro")


def test_directions(rig):
    assert resolve_directions(None) == resolve_directions("both") == ["warp", "weft"]
    assert resolve_directions("weft") == ["weft"]
    assert resolve_directions(None, rig("rig: {direction: weft}")) == ["weft"]
    assert resolve_directions("both", rig("rig: {direction: weft}")) == ["warp", "weft"]
    assert resolve_directions(None, None, ["rig.direction=weft"]) == ["weft"]
    with pytest.raises(InputError, match=r'rig\.yaml:1: rig\.direction = \'wrap\'.*did you mean "warp"'):
        resolve_directions(None, rig("rig: {direction: wrap}"))


def test_options_state_the_fields_that_they_name():
    run = resolve(
        variant="2", test="tensile", scale="meso", direction="weft", preset="quick", parameters="as-measured",
        specimens=3, seed=5,
    )  # fmt: skip
    assert (run.model.scale, run.rig.direction, run.model.preset, run.parameters) == (
        "meso", "weft", "quick", "as-measured",
    )  # fmt: skip
    assert (run.variability.specimens, run.variability.seed) == (3, 5)


@pytest.mark.parametrize("value", ["5", "[1]", ""])
def test_a_section_that_is_no_mapping_is_refused(tmp_path, value):
    """It took the settings of the preset away, and the run went on with defaults."""
    (tmp_path / "r.yaml").write_text(f"solver: {{speed: 1}}\nrig: {value}\n")
    with pytest.raises(InputError, match=r"r\.yaml:2: rig = .*: expected a mapping with fields"):
        resolve(variant="1", config=tmp_path / "r.yaml")
