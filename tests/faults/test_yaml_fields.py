"""Reliability cases 1, 5, 6, 11 to 14: what a config says is judged with file, line, field, value and expectation."""

import pytest

from knittest.base.errors import InputError
from knittest.base.files import configs_dir
from knittest.config.loading import resolve

V1 = (configs_dir() / "fabrics" / "pham2019-v1.yaml").read_text(encoding="utf-8")


def refused(**asked) -> str:
    with pytest.raises(InputError) as error:
        resolve(**({"variant": "1"} | asked))
    return str(error.value)


def refused_rig(tmp_path, text) -> str:
    path = tmp_path / "rig.yaml"
    path.write_text(text, encoding="utf-8")
    return refused(config=path)


def refused_fabric(tmp_path, old, new) -> str:
    assert old in V1
    path = tmp_path / "fabric.yaml"
    path.write_text(V1.replace(old, new, 1), encoding="utf-8")
    return refused(variant=None, fabric=path, parameters="as-measured")


def line_of(text: str) -> int:
    return V1[: V1.index(text)].count("\n") + 1


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("rig:\n  widht: 50", 'rig.yaml:2: rig.widht: unknown field (did you mean "width"?)'),
        ("rigg:\n  width: 50", 'rig.yaml:1: rigg: unknown field (did you mean "rig"?)'),
        ("gauge_length: 50", 'rig.yaml:1: gauge_length: unknown field (did you mean "rig.gauge_length"?)'),
        ("rig:\n  width: true", "rig.yaml:2: rig.width = true: expected a number in mm, found true"),
        ("rig:\n  width: 3,5", "(decimal comma? write 3.5)"),
        ("rig:\n  width: 50 mm", "found text '50 mm' (write 50)"),
        ("rig:\n  width: 25 cm", "(write 250)"),
        ("rig:\n  width: 2,5 cm", "(write 25)"),
        ("rig:\n  width: 3 furlongs", "(write the number without unit, in mm)"),
        ("rig:\n  stop_force_ratio: 20 %", "(write 0.2)"),
        ("rig:\n  stop_force_ratio: 20 x", "(write the number without unit)"),
        ("solver:\n  speed: 120 mm/min", "expected a number in m/s, found text '120 mm/min' (write 0.002)"),
        ("solver:\n  speed: 20 mm/min", "'20 mm/min' (0.000333333 m/s: implausible, expected 0.001 to 50 m/s)"),
        ("rig:\n  width: 12:30", "expected a number in mm, found text '12:30'"),
        ("rig:\n  width: '50'", "expected a number in mm, found text '50'"),
        ("rig:\n  width: [50]", "rig.width = [50]: expected a number in mm, found a list"),
        ("rig:\n  width:", "expected a number in mm, found nothing"),
        ("rig:\n  width: -5", "rig.yaml:2: rig.width = -5: must be greater than 0 mm"),
        (
            "rig:\n  yarn_rounding: Up",
            "rig.yaml:2: rig.yarn_rounding = 'Up': expected down or up (did you mean \"up\"?)",
        ),
        ("rig: 3", "rig.yaml:1: rig = 3: expected a mapping with"),
        ("rig:\n  gauge_length: 0.2", "implausible, expected 5 to 2000 mm (it looks like m: 200 mm)"),
        ("solver:\n  speed: 100", "it looks like mm/s: 0.1 m/s or mm/min: 0.00166667 m/s"),
        ("model:\n  meso:\n    elements_per_loop: 32.5", "elements_per_loop = 32.5: expected a whole number"),
        ("model:\n  meso:\n    contact: 'no'", "must be a valid boolean"),
        ("variability:\n  seed: -1", "variability.seed = -1: must be greater than or equal to 0"),
        ("model:\n  scale: mesoo", "rig.yaml:2: model.scale = 'mesoo': unknown choice (did you mean \"meso\"?)"),
        ("parameters: 3", "rig.yaml:1: parameters: expected a name, found 3"),
    ],
)
def test_rig_file(tmp_path, text, expected):
    assert expected in refused_rig(tmp_path, text)


CURVE = "pham2019/curves/tensile-v1-warp.csv"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("value: 59.3", "value: 59300", "= 59300: implausible, expected 0.1 to 1000 GPa (it looks like MPa: 59.3 GPa)"),
        ("value: 824.2", "value: 0.8242", "(it looks like kg/m2: 824.2 g/m2"),
        ("value: 2.69", "value: 0.0269", "(it looks like a fraction: 2.69 %)"),
        ("value: 14.4", "value: 0.0144", "(it looks like m: 14.4 mm)"),
        ("value: 14.4", "value: 5", "must be more than 7.99 mm"),
        ("warp_density: {value: 28", "warp_density: {value: 3 yarn/cm", "found text '3 yarn/cm' (write 30)"),
        ("warp_density: {value: 28", "warp_density: {value: 28 yarns / dm", "(write 28)"),
        (
            "warp_density: {value: 28",
            "warp_density: {value: 28 yarn/cm",
            "(280 yarn/100 mm: implausible, expected 5 to",
        ),
        ("value: 0.6", "value: 0.006 %", "(0.006 %: implausible, expected 0 or at least 0.02 %)"),
        ("value: 824.2", "value: 0.8 kg/m²", "(write 800)"),
        ("warp_density: {value: 28", "warp_density: {value: 2.8", "(it looks like yarns/cm: 28 yarn/100 mm)"),
        ("value: 0.784", "value: 0", "must be greater than 0 mm2"),
        ("value: 59.3", "value: -59.3", "must be greater than 0 GPa"),
        ("value: 0.3,", "value: -0.1,", "must be at least 0"),
        ("sd: 17.7", "sd: -17.7", "youngs_modulus.sd = -17.7: must be greater than or equal to 0 GPa"),
        ("source: measured", "source: mesured", '(did you mean "measured"?)'),
        ("name: pham2019-v1", "name: ../<b>", "expected letters, digits"),
        ("name: pham2019-v1", "name: 12", "expected text, found 12"),
        ("loop_length:", "loop_lenght:", 'loop_lenght: unknown field (did you mean "loop_length"?)'),
        ("  law: {kind: linear}", "  law: {kind: toe}", "must be greater than 0 % for kind toe"),
        (
            "  law: {kind: linear}",
            "  law: {kind: table, points: [[0, 0], [1, 5], [1, 6]]}",
            "strains must rise strictly",
        ),
        ("  law: {kind: linear}", "  law: {kind: table, points: [[0, 0], [1, 5], [2, 4]]}", "stresses must not fall"),
        (
            "  law: {kind: linear}",
            "  law: {kind: table, points: [[0, 0], [1, true]]}",
            "points[1][1] = true: expected a num",
        ),
        (
            CURVE,
            "[[0, 0], [60, 2]]",
            "tension.warp = [[0, 0], [60, 2]]: expected a CSV, or a mapping such as {points: ",
        ),
        (
            CURVE,
            "{points: [[0, 0], [2, 6], [1, 8]], source: user}",
            "tension.warp.points = [[0, 0], [2, 6], [1, 8]]: str",
        ),
        (
            CURVE,
            "{points: [[0, 0], [2, 6]], sorce: user}",
            'tension.warp.sorce: unknown field (did you mean "source"?)',
        ),
        (CURVE, "{points: [[0, 0], 30], source: user}", "points[1] = 30: expected a list of numbers in brackets"),
        (CURVE, "{points: [[0, 0], [1, 2, 3]], source: user}", "points[1] = [1, 2, 3]: expected at most 2 entries"),
        (CURVE, "{points: [[0, 0], [1]], source: user}", "points[1][1]: missing: one more entry of the list"),
        ("name: pham2019-v1", "$schema: x", "$schema: unknown field"),
        ("as-measured: {}", "as-measured: 3", "as-measured: expected a mapping of fabric fields, found 3"),
    ],
)
def test_fabric_file(tmp_path, old, new, expected):
    message = refused_fabric(tmp_path, old, new)
    assert expected in message
    assert f"fabric.yaml:{line_of(old)}: " in message or "missing" in expected


def test_tuned_value_must_say_on_what(tmp_path):
    message = refused_fabric(tmp_path, "value: 0.136, source: derived", "value: 0.136, source: tuned")
    assert "needs tuned_on" in message


def test_all_findings_come_in_one_message(tmp_path):
    message = refused_rig(tmp_path, "rig:\n  widht: 1\n  width: true\nsolver:\n  speed: -1\n")
    assert [line.split(": ")[0].rpartition(":")[2] for line in message.splitlines()] == ["3", "2", "5"]


@pytest.mark.parametrize(
    ("target", "expected"),
    [*((path, "expected a path in") for path in ("/etc/passwd", "../../../../etc/passwd", "/dev/zero", "link.csv")),
     ("folder.csv", "expected a regular file")],
)  # fmt: skip
def test_a_curve_is_a_file_in_its_folders(tmp_path, target, expected):
    (tmp_path / "link.csv").symlink_to("/etc/passwd")
    (tmp_path / "folder.csv").mkdir()
    message = refused_fabric(tmp_path, CURVE, target)
    assert expected in message
    if expected == "expected a path in":
        assert f"fabric.yaml:{line_of(CURVE)}: fabric.macro.tension.warp = {target!r}: expected a path in" in message


@pytest.mark.parametrize("name", ["../configs/x", "a/b", "", "x" * 60, "<b>", "a\0b"])
def test_variant_is_a_name_not_a_path(name):
    assert "--variant" in refused(variant=name)


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ("rig", "expected key.path=value"),
        ("rig..width=3", "expected key.path=value"),
        ("rig.width=[", "--set rig.width:1: not valid YAML"),
        ("rig.width=*a", "anchors and aliases are not allowed"),
        ("rig.widht=3", '--set rig.widht: rig.widht: unknown field (did you mean "width"?)'),
        ("rig.width.x=3", "rig.width: expected a number in mm, found a mapping"),
        ("fabric.loop_length=3,5", "(decimal comma? write 3.5)"),
        ("fabric.reinforcing.crimp=much", "fabric.reinforcing.crimp = 'much': expected a mapping with warp, weft"),
        ("fabric.macro.tension.wrap=a", 'unknown field, expected warp or weft (did you mean "warp"?)'),
    ],
)
def test_set(setting, expected):
    assert expected in refused(sets=[setting])


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('experiment_variant: "1"', 'experiment_variant: "3"', "= '3': expected one of"),
        ('experiment_variant: "1"', "# none", "fabric.experiment_variant: missing: name of this fabric"),
        ("experiment: pham2019", "experiment: empty", "no tables of an experiment"),
        (
            "experiment: pham2019",
            "experiment: pham2019/curves",
            "expected the columns variant",
        ),
    ],
)
def test_an_experiment_that_no_run_could_be_compared_with(tmp_path, old, new, expected):
    (tmp_path / "empty").mkdir()
    assert expected in refused_fabric(tmp_path, old, new)


def test_imported_data_lie_under_the_data_folder_here(tmp_path, monkeypatch):
    (tmp_path / "data" / "mine").mkdir(parents=True)
    (tmp_path / "data" / "mine" / "t.csv").write_text(
        "variant,direction,quantity,mean,sd,n,unit,table\nA,warp,q,1,,,N,T\n"
    )
    text = V1.replace("experiment: pham2019", "experiment: mine").replace('variant: "1"', "variant: A")
    text = text.replace("pham2019/curves/tensile-v1-warp.csv", "mine/t.csv")
    (tmp_path / "fabric.yaml").write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    fabric = resolve(fabric="fabric.yaml").fabric
    assert fabric.experiment == str(tmp_path / "data" / "mine")
    assert fabric.macro.tension["warp"] == str(tmp_path / "data" / "mine" / "t.csv")
