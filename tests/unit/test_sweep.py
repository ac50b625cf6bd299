"""Way of a sweep file to its runs: what multiplies, what is drawn, what is refused and where."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from knittest.base.errors import InputError
from knittest.base.files import PACKAGE, configs_dir
from knittest.config.studies import Distribution, Sample
from knittest.config.yaml_loader import load_yaml, parse_document
from knittest.studies.batch.plan import SweptField, plan_of
from knittest.studies.trials.case import draw_points

BASE = "base: {variant: 1, scale: macro, preset: quick, direction: warp}\n"


def plan(text: str, tmp_path=None):
    return plan_of(parse_document(text, str(tmp_path / "s.yaml") if tmp_path else "s.yaml"))


def sample(method="latin-hypercube", n=400, seed=1, **fields) -> np.ndarray:
    fields = {name: Distribution(**one) for name, one in fields.items()}
    return np.array(draw_points(Sample(method=method, n=n, seed=seed, fields=fields)))


def test_blocks_multiply_and_every_run_has_its_values():
    found = plan(
        "base: {variant: ['1', '2'], scale: macro, preset: [quick, standard], direction: both}\n"
        "grid: {solver.damping: [0.1, 0.2]}\n"
        "range: {rig.width: {low: 20, high: 40, steps: 3}}\n"
        "points: [{solver.speed: 1.0, solver.ramp: 0.2}, {solver.speed: 2.0, solver.ramp: 0.1}]\n"
        "ensemble: {specimens: 2, seeds: [3, 4]}\n"
    )
    rows = found.rows()
    assert found.count == len(rows) == 2 * 2 * 2 * 2 * 3 * 2 * 2
    assert len({row.trial.key for row in rows}) == len(rows)
    run = rows[-1].trial.run
    assert (run.fabric.name, run.direction, run.model.preset) == ("pham2019-v2", "weft", "standard")
    assert (run.rig.width, run.solver.damping, run.solver.speed, run.solver.ramp) == (40.0, 0.2, 2.0, 0.1)
    assert (run.variability.seed, run.variability.specimens) == (4, 2)
    assert rows[-1].values == {
        "variability.seed": 4, "solver.damping": 0.2, "rig.width": 40, "solver.speed": 2.0, "solver.ramp": 0.1,
    }  # fmt: skip


def test_tests_without_a_direction_run_once_and_others_in_both():
    rows = plan("base: {test: [picture-frame, tensile], variant: 1, scale: macro}").rows()
    assert [(r.trial.run.rig.kind, r.trial.run.direction) for r in rows] == [
        ("picture-frame", ""), ("tensile", "warp"), ("tensile", "weft"),
    ]  # fmt: skip
    rows = plan("base: {variant: 1, scale: macro}\ngrid: {rig.direction: [weft]}").rows()
    assert [row.trial.run.direction for row in rows] == ["weft"]


def test_ranges_are_even_and_whole_where_they_can_be():
    text = BASE + "range: {%s: {low: %s, high: %s, steps: %d, spacing: %s}}"
    values = [r.values["rig.width"] for r in plan(text % ("rig.width", 20, 40, 3, "linear")).rows()]
    assert values == [20, 30, 40] and all(isinstance(v, int) for v in values)
    values = [r.values["solver.speed"] for r in plan(text % ("solver.speed", 0.25, 16, 7, "log")).rows()]
    assert values == [0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0]
    seeds = plan(text % ("variability.seed", 1, 5, 5, "linear")).rows()
    assert [row.trial.run.variability.seed for row in seeds] == [1, 2, 3, 4, 5]
    text = BASE + "sample: {n: 5, fields: {variability.seed: {low: 1, high: 1000, whole: true}}}"
    assert all(isinstance(row.trial.run.variability.seed, int) for row in plan(text).rows())


def test_a_latin_hypercube_has_one_point_in_every_stratum():
    points = sample(n=50, a={"low": 0.0, "high": 50.0}, b={"low": -25.0, "high": 25.0})
    for column, low in ((points[:, 0], 0.0), (points[:, 1], -25.0)):
        assert sorted(np.floor(column - low)) == list(range(50))
    independent = sample("random", n=50, a={"low": 0.0, "high": 50.0})
    assert len(set(np.floor(independent[:, 0]))) < 45


@pytest.mark.parametrize("method", ["random", "latin-hypercube"])
@pytest.mark.parametrize(
    ("distribution", "law"),
    [
        ({"low": 2.0, "high": 5.0}, stats.uniform(2.0, 3.0)),
        ({"kind": "log-uniform", "low": 0.1, "high": 10.0}, stats.loguniform(0.1, 10.0)),
        ({"kind": "normal", "mean": 3.0, "sd": 2.0}, stats.norm(3.0, 2.0)),
        ({"kind": "normal", "mean": 3.0, "sd": 2.0, "low": 2.0}, stats.truncnorm(-0.5, np.inf, 3.0, 2.0)),
        ({"kind": "normal", "mean": 3.0, "sd": 2.0, "low": 2.0, "high": 4.0}, stats.truncnorm(-0.5, 0.5, 3.0, 2.0)),
    ],
)
def test_draws_follow_their_distribution(method, distribution, law):
    points = sample(method, a=distribution)
    assert stats.kstest(points[:, 0], law.cdf).pvalue > 0.01
    assert (points == sample(method, a=distribution)).all()
    assert (points != sample(method, seed=2, a=distribution)).all()


def test_what_is_too_much_is_counted_without_making_it():
    text = BASE + "range: {solver.speed: {low: 1, high: 2, steps: 99999999999}}\n"
    text += "sample: {n: 99999999999, fields: {rig.width: {low: 20, high: 30}}}"
    assert plan(text).count == 99999999999**2


def test_a_drawn_value_that_is_refused_is_a_row_and_the_others_run():
    text = BASE + "sample: {n: 8, fields:\n  {rig.width: {low: -50, high: 60}}}"
    rows = plan(text).rows()
    bad = [row for row in rows if row.trial is None]
    assert 0 < len(bad) < len(rows)
    assert all(row.problem.startswith("s.yaml:3: rig.width = ") for row in bad)
    listed = BASE + "grid:\n  rig.width: [20, -20]\nsample: {n: 3, fields: {solver.speed: {low: 1, high: 2}}}"
    for stops in (text.replace("high: 60", "high: -1"), listed):
        with pytest.raises(InputError, match=r"s\.yaml:3: rig\.width = -\d.*must be greater than 0"):
            plan(stops).rows()


@pytest.mark.parametrize(
    "block",
    [
        "points: [{D: null, T: 0.1}, {D: 1.0, T: null}]",
        "points: [{D.value: null, T: 0.1}, {D.value: 1.0, T: null}]",
        "grid: {D: [null, 1.0]}",
    ],
)
def test_a_null_takes_a_number_of_the_fabric_away(tmp_path, block):
    text = (configs_dir() / "fabrics" / "pham2019-v1.yaml").read_text()
    (tmp_path / "mine.yaml").write_text(text.replace("  degree_of_set:", "  loop_shortening: 2.0\n  degree_of_set:"))
    named = block.replace("D", "fabric.knitting.loop_shortening").replace("T", "fabric.knitting.tension")
    rows = plan("base: {fabric: mine.yaml, scale: meso, direction: warp}\n" + named, tmp_path).rows()
    bare, drawn_in = (row.trial.run.fabric.knitting for row in rows)
    assert bare.loop_shortening is None and drawn_in.loop_shortening.value == 1.0 and drawn_in.tension is None
    assert (bare.tension is None) == (block[0] == "g")


def test_files_are_found_from_the_folder_of_the_sweep(tmp_path):
    (tmp_path / "rig.yaml").write_text("rig: {width: 30}\n")
    (tmp_path / "mine.yaml").write_bytes((configs_dir() / "fabrics" / "pham2019-v2.yaml").read_bytes())
    rows = plan("base: {fabric: mine.yaml, config: rig.yaml, scale: macro, direction: warp}", tmp_path).rows()
    assert (rows[0].trial.run.fabric.name, rows[0].trial.run.rig.width) == ("pham2019-v2", 30.0)


def test_the_sweep_in_the_documentation_is_one():
    page = (PACKAGE.parent / "docs" / "batch.md").read_text(encoding="utf-8")
    found = plan(page.partition("## The file")[2].split("```")[1])
    assert found.count == 2 * 2 * 3 * 7 * 2 * 20 * 3
    assert found.swept_fields[-3:] == [
        SweptField("fabric.thickness", False, True), SweptField("fabric.macro.bending_stiffness.warp", True, True),
        SweptField("model.macro.element_size", False, True),
    ]  # fmt: skip
    first = replace(found, axes=[axis for axis in found.axes if not axis.is_random][:5], cases=found.cases[:1])
    assert all(row.trial for row in first.rows())


@pytest.mark.parametrize("path", sorted((configs_dir() / "sweeps").glob("*.yaml")), ids=lambda path: path.name)
def test_shipped_sweeps_are_planned(path):
    assert all(row.trial for row in plan_of(load_yaml(path)).rows())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("bse: {}", 's.yaml:1: bse: unknown field (did you mean "base"?)'),
        ("base: {variant: 9}", "s.yaml:1: --variant 9: unknown fabric"),
        ("base: {scale: macro}", "s.yaml:1: base: no fabric is given"),
        ("base: {variant: 1, test: tensil}", "s.yaml:1: base.test = 'tensil': unknown test (did you mean"),
        ("base: {variant: 1, direction: wrap}", "s.yaml:1: base.direction = 'wrap': expected warp, weft or both"),
        ("base: {variant: 1, fabric: no.yaml}", "s.yaml:1: base.fabric: no such file: "),
        (BASE + "grid:\n  rig.widht: [1]", 's.yaml:3: rig.widht: unknown field (did you mean "width"?)'),
        (BASE + "grid:\n  rig.width: [20, -1]", "s.yaml:3: rig.width = -1: must be greater than 0 mm"),
        (BASE + "grid:\n  rig.width: [20, wide]", "s.yaml:3: rig.width = 'wide': expected a number in mm"),
        (BASE + "grid: {fabric.thickness: [null]}", "s.yaml:2: fabric.thickness: expected a number in mm"),
        (BASE + "grid:\n  rig..width: [20]", "s.yaml:3: 'rig..width': expected the dotted path"),
        (BASE + "range:\n  rig.width:\n    low: 5\n    high: 3\n    steps: 3", "s.yaml:5: range.rig.width.high = 3: "),
        (BASE + "sample: {n: 3, fields: {rig.width: {low: 9, high: 5}}}", "must be greater than low = 9"),
        (BASE + "sample: {n: 3, fields: {rig.width: {kind: normal, mean: 9}}}", "a normal distribution needs mean"),
        (BASE + "grid: {rig.width: [20]}\nrange:\n  rig.width: {low: 5, high: 9, steps: 2}",
         "s.yaml:4: rig.width: given twice, first at s.yaml:2"),
        (BASE + "grid: {model.scale: [macro]}", "s.yaml:2: model.scale: given twice, first at s.yaml:1"),
        (BASE + "grid: {rig.direction: [warp]}", "s.yaml:1: base.direction: rig.direction is given as well"),
        (BASE + "points: [{rig.width: 20},\n  {solver.speed: 1}]", "s.yaml:3: points[1]: expected the fields of the"),
        (BASE + "grid: {rig: [1]}", "s.yaml:1: base.direction: rig.direction is given as well"),
        ("base: {variant: 1, scale: macro}\ngrid: {rig: [1]}", "s.yaml:2: rig = 1: expected a mapping"),
        (BASE + "grid: {rig.width: [20]}\npoints:\n  [{rig: {width: 30}}]", "s.yaml:3: rig: given twice, first at"),
        (BASE + "grid: {rig.width.mm: [20]}", "s.yaml:2: rig.width: expected a number in mm"),
    ],
)  # fmt: skip
def test_bad_sweeps_are_refused_where_they_are_wrong(text, said):
    with pytest.raises(InputError) as caught:
        plan(text).rows()
    assert said in str(caught.value)
