"""A calibration finds what its targets ask for, once, whatever becomes of single trials."""

from pathlib import Path

import numpy as np
import pytest
from calibration_cases import BEND, TWO, WARP, WEFT, Pretending, Stopping, calibrate, outcome, overhang, values

from knittest.base.files import configs_dir
from knittest.base.interrupts import Interrupted
from knittest.config.loading import resolve
from knittest.config.yaml_loader import load_yaml
from knittest.studies.calibrate.outcome import estimate_from_slopes
from knittest.studies.calibrate.problem import Parameter, problem_of

RESULT = Path("runs/calibrate-c")


def test_one_parameter_is_found_in_a_handful_of_runs(tmp_path, monkeypatch):
    pool = Pretending()
    assert calibrate(BEND, tmp_path, monkeypatch, pool) == 0
    found = outcome(tmp_path)
    assert len(pool.asked) == found["runs"] <= 7 and found["status"] == "converged" and found["method"] == "root"
    assert abs(overhang(values(tmp_path)[0]) - 171.0) <= 0.01 * 51.0
    assert found["parameters"][0]["sd"] == pytest.approx(WARP * 3.0 * 51.0 / 171.0, rel=0.1)  # dB/B = 3 dL/L
    assert found["parameters"][0]["interval_95"] == [2.0, 12.0] and "poorly determined" in found["warnings"][0]
    assert (RESULT / "convergence.png").read_bytes().startswith(b"\x89PNG")
    shipped = (configs_dir() / "calibrations/v1-warp-bending.yaml").read_text()
    assert calibrate(shipped, tmp_path, monkeypatch, Pretending()) == 0
    assert values(tmp_path)[0] == pytest.approx(5.05, rel=0.03)


@pytest.mark.parametrize("path", sorted((configs_dir() / "calibrations").glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_calibrations_enclose_the_shipped_values(path):
    problem = problem_of(load_yaml(path))
    case = problem.cases[0]
    shipped = resolve(test=case.kind, fabric=case.fabric, scale=case.run().model.scale)
    for parameter in problem.parameters:
        value = shipped
        for part in parameter.paths[0]:
            value = getattr(value, part)
        assert parameter.low < getattr(value, "value", value) < parameter.high


def test_the_calibrated_fabric_says_where_its_number_comes_from(tmp_path, monkeypatch):
    calibrate(BEND, tmp_path, monkeypatch, Pretending())
    run = resolve(fabric=RESULT / "fabric.yaml", scale="macro", test="cantilever")
    own, shipped = run.fabric, resolve(variant="1", scale="macro", test="cantilever").fabric
    quantity = own.macro.bending_stiffness.warp
    assert quantity.value == values(tmp_path)[0] and quantity.source == "tuned"
    assert quantity.tuned_on == ["V1 warp overhang_mm"]
    assert all(one in quantity.ref for one in ("95 % interval", "runs): residual", "before: 5.05 (derived)"))
    kept = {"bending_stiffness": shipped.macro.bending_stiffness}
    assert own.model_copy(update={"macro": own.macro.model_copy(update=kept)}) == shipped


def test_what_is_finished_is_not_run_again(tmp_path, monkeypatch):
    first = Stopping(4)
    with pytest.raises(Interrupted, match="run the same command again to resume"):
        calibrate(BEND, tmp_path, monkeypatch, first)
    second, third = Pretending(), Pretending()
    assert calibrate(BEND, tmp_path, monkeypatch, second) == 0
    assert first.asked[-1] == second.asked[0] and not set(first.asked[:-1]) & set(second.asked)
    again = outcome(tmp_path)["evaluations"]
    assert calibrate(BEND, tmp_path, monkeypatch, third) == 0
    assert third.asked == [] and outcome(tmp_path)["evaluations"] == again


@pytest.mark.parametrize("method", ["least-squares", "differential-evolution"])
def test_several_parameters_are_found(tmp_path, monkeypatch, method):
    assert calibrate(f"{TWO}method: {method}\nmax_runs: 150\n", tmp_path, monkeypatch, Pretending()) == 0
    found = outcome(tmp_path)
    assert values(tmp_path) == pytest.approx([WARP, WEFT], rel=0.02 * 3 * 51 / 171)
    assert found["rms_deviation_sd"] <= 0.02 and len(found["warnings"]) == 1
    assert found["runs"] <= (30 if method == "least-squares" else 150)
    weft = found["parameters"][1]
    assert weft["sd"] == pytest.approx(WEFT * 3 * 15 / 151, rel=0.1)
    assert weft["interval_95"] == pytest.approx([WEFT - 1.96 * weft["sd"], WEFT + 1.96 * weft["sd"]], rel=0.02)


def test_a_parameter_without_influence_is_told(tmp_path, monkeypatch):
    idle = "  fabric.thickness: {low: 1, high: 4, mean: 2.2, sd: 0.1}\ntests:"
    assert calibrate(TWO.replace("tests:", idle), tmp_path, monkeypatch, Pretending()) == 0
    found = outcome(tmp_path)
    (warning,) = [text for text in found["warnings"] if text.startswith("fabric.thickness has no influence")]
    assert "its value is that of the prior" in warning and found["parameters"][2]["sensitivity_sd"] < 1e-6
    assert values(tmp_path) == pytest.approx([WARP, WEFT, 2.2], rel=0.05)


def test_parameters_that_cannot_be_told_apart_are_told():
    names = ("warp", "weft")
    both = [Parameter((("fabric", name),), "N mm", 1.0, 9.0, 5.0, False, None, "c.yaml:4") for name in names]

    def warnings(*slopes):
        return estimate_from_slopes(both, (5.0, 5.0), np.array(slopes), 0.05).warnings

    assert warnings([20.0, 0.0], [0.0, 20.0]) == []
    assert warnings([60.0, 60.0], [60.0, 90.0]) == [
        "fabric.warp and fabric.weft are strongly correlated (-0.98): add a target or a prior"
    ]
    assert "the targets cannot determine all parameters" in warnings([20.0, 20.0])[-1]


def test_a_prior_pulls_as_its_sd_says(tmp_path, monkeypatch):
    prior = BEND.replace("spacing: log", "mean: 6, sd: 0.5")
    assert calibrate(prior, tmp_path, monkeypatch, Pretending()) == 0
    slope = overhang(WARP) / (3.0 * WARP) / 51.0  # sd of the target per N mm
    expected = (WARP * slope**2 + 6.0 / 0.25) / (slope**2 + 4.0)
    assert outcome(tmp_path)["method"] == "least-squares"
    assert outcome(tmp_path)["parameters"][0]["sd"] == pytest.approx((slope**2 + 4.0) ** -0.5, rel=0.05)
    assert values(tmp_path)[0] == pytest.approx(expected, abs=0.02) and abs(expected - WARP) > 0.1


def test_weights_decide_between_targets_that_disagree(tmp_path, monkeypatch):
    text = BEND.replace("targets:", "targets:\n  - {test: bend, quantity: overhang_mm, value: 160, sd: 51, weight: 3}")
    assert calibrate(text, tmp_path, monkeypatch, Pretending()) == 0
    assert overhang(values(tmp_path)[0]) == pytest.approx((3 * 160 + 171) / 4, abs=0.3)


HEAD = "# kind: measured\n# direction: warp\n"


@pytest.mark.parametrize("width", [50, 100])
def test_a_curve_is_followed_per_width(tmp_path, monkeypatch, width):
    strain = np.linspace(0.0, 2.0, 41)
    rows = "\n".join(f"{x:g},{60 * width * x**1.5:g},{2 * width * x:g}" for x in strain)
    (tmp_path / "own.csv").write_text(f"{HEAD}# strip_width_mm: {width}\nstrain_pct,force_n,force_sd_n\n{rows}\n")
    text = """
base: {variant: 1, scale: macro, preset: quick}
parameters: {fabric.macro.fracture_strain.warp: {low: 1, high: 3}}
tests: {pull: {test: tensile, direction: warp}}
targets: [{test: pull, curve: own.csv}]
"""

    def curve(trial):
        share = trial.run.fabric.macro.fracture_strain.warp.value / 1.7
        return strain, 3000 * share * strain**1.5

    pool = Pretending(lambda trial: {"peak_force_n": 1.0}, curve=curve)
    assert calibrate(text, tmp_path, monkeypatch, pool) == 0
    assert values(tmp_path)[0] == pytest.approx(1.7, rel=1e-3)
    assert outcome(tmp_path)["targets"][0]["source"] == (
        "own.csv (measured)" if width == 50 else "own.csv (measured; scaled from 100 to 50 mm)"
    )


def test_a_fabric_of_ones_own_takes_its_files_along(tmp_path, monkeypatch):
    lab = tmp_path / "lab"
    for direction in ("warp", "weft"):
        (lab / direction).mkdir(parents=True)
        (lab / direction / "tension.csv").write_text(
            f"# kind: measured\n# {direction}\nstrain_pct,force_n_per_mm\n0,0\n2,180\n"
        )
    head = "variant,direction,quantity,mean,sd,n,unit,table"
    (lab / "bending.csv").write_text(f"{head}\nmine,warp,overhang_mm,160,8,5,mm,own\n")
    shipped = (configs_dir() / "fabrics/pham2019-v1.yaml").read_text()
    for direction in ("warp", "weft"):
        shipped = shipped.replace(f"pham2019/curves/tensile-v1-{direction}.csv", f"lab/{direction}/tension.csv")
    own = shipped.replace("experiment: pham2019", "experiment: lab").replace('variant: "1"', "variant: mine")
    (tmp_path / "own.yaml").write_text(own)
    assert calibrate(BEND.replace("variant: 1", "fabric: own.yaml"), tmp_path, monkeypatch, Pretending()) == 0
    assert overhang(values(tmp_path)[0]) == pytest.approx(160.0, abs=0.1)
    moved = tmp_path / "elsewhere"
    RESULT.rename(moved)
    monkeypatch.chdir(tmp_path / "lab/warp")
    fabric = resolve(fabric=moved / "fabric.yaml", scale="macro", test="cantilever").fabric
    texts = {direction: Path(path).read_text() for direction, path in fabric.macro.tension.items()}
    assert all(f"# {direction}\n" in text for direction, text in texts.items())
    assert fabric.experiment == str(moved / "data/experiment")


def test_a_rig_is_calibrated_into_a_rig_file(tmp_path, monkeypatch):
    text = """
base: {variant: 1, scale: macro, preset: quick}
parameters: {rig.kinetic_coefficient: {low: 0.02, high: 0.3, also: [rig.static_coefficient]}}
tests: {pull: {test: friction, direction: warp}}
targets: [{test: pull, quantity: mu_paper}]
"""
    pool = Pretending(lambda t: {"mu_paper": 2 * t.run.rig.kinetic_coefficient})
    assert calibrate(text, tmp_path, monkeypatch, pool) == 0
    rig = resolve(variant="1", config=RESULT / "rig-friction.yaml", test="friction").rig
    assert rig.kinetic_coefficient == rig.static_coefficient == pytest.approx(0.075, abs=0.0002)
    assert "tuned by knittest calibrate c on V1 warp mu_paper" in (RESULT / "rig-friction.yaml").read_text()
    assert not (RESULT / "fabric.yaml").exists()
