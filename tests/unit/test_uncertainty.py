"""Numbers of a study of uncertainty: known indices, bands, shares, what is recorded of lost runs, going on."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest
from calibration_cases import Pretending, Stopping
from scipy.stats import qmc
from uncertainty_cases import STUDY, ishigami, outcome, shearing, study, values, variable

from knittest.base.errors import InputError
from knittest.base.interrupts import Interrupted
from knittest.studies.uncertainty.indices import indices, share, spread, varies
from knittest.studies.uncertainty.problem import design

RESULT = Path("runs/uncertainty-u")
FRICTION, DEGREE = "fabric.contact.friction_coefficient", "fabric.knitting.degree_of_set"


def rows(folder: Path) -> list[dict[str, str]]:
    return list(csv.DictReader((folder / RESULT / "results.csv").read_text().splitlines()))


@pytest.fixture(scope="module")
def ran(tmp_path_factory) -> Path:
    """Folder in which the study ran to its end."""
    folder = tmp_path_factory.mktemp("ran")
    with pytest.MonkeyPatch.context() as patch:
        assert study(STUDY, folder, patch) == 0
    return folder


@pytest.fixture
def copied(ran, tmp_path) -> Path:
    """A copy of that folder, to go on in."""
    return Path(shutil.copytree(ran, tmp_path / "copy"))


def test_the_design_is_two_samples_and_their_mixtures():
    points = design(3, 16, 5)
    a, b = points[:2]
    assert points.shape == (5, 16, 3)
    for i in range(3):
        others = [k for k in range(3) if k != i]
        assert np.array_equal(points[2 + i][:, i], b[:, i]) and np.array_equal(points[2 + i][:, others], a[:, others])
    assert qmc.discrepancy(np.hstack([a, b])) < qmc.discrepancy(np.random.default_rng(1).random((16, 6)))
    assert not np.array_equal(points, design(3, 16, 6)) and np.array_equal(points, design(3, 64, 5)[:, :16])
    assert sorted((a[:, 0] * 16).astype(int)) == list(range(16))  # one in each stratum: the sequence is balanced


def test_indices_of_ishigami_are_those_of_the_closed_form():
    a, b = 7.0, 0.1
    v1, v2, v13 = 0.5 * (1 + b * np.pi**4 / 5) ** 2, a**2 / 8, b**2 * np.pi**8 * (1 / 18 - 1 / 50)
    total = v1 + v2 + v13
    found = indices(ishigami(design(3, 1024, 1)), 1)
    assert found.first == pytest.approx([v1 / total, v2 / total, 0.0], abs=0.03)
    assert found.total == pytest.approx([(v1 + v13) / total, v2 / total, v13 / total], abs=0.03)
    for value, (low, high) in ((found.first, found.first_interval), (found.total, found.total_interval)):
        assert (low <= value).all() and (value <= high).all() and (high - low < 0.25).all()


def test_indices_of_a_linear_function_are_its_shares_of_the_variance():
    slopes = np.array([1.0, 2.0, 3.0, 0.0])
    found = indices(design(4, 256, 2) @ slopes, 2)
    shares = slopes**2 / (slopes**2).sum()
    assert found.first == pytest.approx(shares, abs=0.02) and found.total == pytest.approx(shares, abs=0.02)
    assert found.total[3] == found.first[3] == 0.0
    again, other = indices(design(4, 256, 2) @ slopes, 2), indices(design(4, 256, 2) @ slopes, 3)
    assert np.array_equal(again.total_interval, found.total_interval)
    assert not np.array_equal(other.total_interval, found.total_interval)
    missing = design(2, 16, 1).sum(axis=-1)
    missing[2, 3] = np.nan
    with pytest.raises(ValueError, match="not every row"):
        indices(missing, 1)
    assert not varies(5.0 + 1e-12 * np.arange(10)) and varies(5.0 + 1e-3 * np.arange(10)) and not varies(np.zeros(4))


def test_bands_are_percentiles_and_their_intervals_hold_them():
    found = spread(design(2, 512, 3)[:2, :, 0] * 10.0, 1)
    assert found.count == 1024 and found.band == pytest.approx([0.5, 5.0, 9.5], abs=0.1)
    assert (found.interval[0] <= found.band).all() and (found.band <= found.interval[1]).all()
    assert 0.3 < found.interval[1][1] - found.interval[0][1] < 1.2  # 2 x 1.96 x 10 x 0.5 / sqrt(1024) = 0.61
    gone = np.full((2, 16), np.nan)
    gone[:, :9] = 1.0
    assert spread(gone, 1) is None and spread(np.where(np.isnan(gone), 2.0, gone), 1).count == 32
    gone[0, 9:11] = 1.0
    assert spread(gone, 1).count == 20


def test_a_share_says_what_the_missing_could_make_of_it():
    holds = np.ones((2, 20))
    holds[:, :5], holds[0, 5:9] = 0.0, np.nan
    fails = holds == 0.0
    found = share(holds, fails, 1)
    assert (found.holds, found.count, found.total, found.failing) == (26, 36, 40, 0) and found.value == 26 / 36
    assert found.possible == (26 / 40, 30 / 40) and found.interval[0] < 26 / 36 < found.interval[1]
    fails[0, 5:8] = True  # a place that they have decides three of the four: the limits, and not the share
    decided = share(holds, fails, 1)
    assert decided.failing == 3 and decided.possible == (26 / 40, 27 / 40) and decided.value == found.value
    assert share(np.full((2, 20), np.nan), np.zeros((2, 20), bool), 1).value is None


def test_every_fabric_runs_with_the_same_draws_and_the_table_has_them(ran):
    table = rows(ran)
    assert len(table) == 4 * 16 and outcome(ran)["runs"] == 2 * 4 * 16
    assert {row["V1 status"] for row in table} == {row["V2 status"] for row in table} == {"completed"}
    friction, degree = (np.array([float(row[name]) for row in table]) for name in (FRICTION, DEGREE))
    assert 0.1 <= friction.min() < 0.13 and 0.47 < friction.max() <= 0.5 and degree.min() >= 0.5
    v1 = 1.0 + 10.0 * friction - 0.3
    assert [float(row["V1 force, 10"]) for row in table] == pytest.approx(v1)
    ratio = [float(row["V2/V1 force, 20"]) for row in table]
    assert ratio == pytest.approx((1.0 + 10.0 * friction - 2.0 * (1.0 - degree)) / v1)


def test_bands_indices_and_shares_are_those_of_the_formula(ran):
    force, ratio = variable(ran, "V1 force, 10"), variable(ran, "V2/V1 force, 10")
    assert force["band"] == pytest.approx([1.9, 3.7, 5.5], abs=0.15) and force["count"] == force["points"] == 32
    first = {one["parameter"]: one["first"] for one in force["indices"]}
    assert first[FRICTION] == pytest.approx(1.0, abs=0.05) and first[DEGREE] == 0.0
    assert max(ratio["indices"], key=lambda one: one["first"])["parameter"] == DEGREE
    onset = variable(ran, "V2 onset")
    assert onset["indices"] == [] and onset["no_indices"] == "the quantity does not change over the prior"
    (stated,) = outcome(ran)["statements"]
    drawn = [float(row[DEGREE]) for row in rows(ran) if row["part"] in "AB"]
    least = np.mean(np.array(drawn) < 0.85)  # 2 (1 - degree) above 0.3
    assert 0.6 < least < 0.8 and len(drawn) == 32
    assert stated["text"] == "force of V2 below V1 at 10, 20" and stated["share"] == least
    assert stated["possible"] == [least, least] and outcome(ran)["lost"] == []


def test_a_statement_holds_where_it_holds_at_all_places(tmp_path, monkeypatch):
    def crossing(trial):
        return {**shearing(trial), "shear_force_n_at_deg.20": 5.0 if trial.run.fabric.name == "pham2019-v1" else 6.0}

    more = "  between: {quantity: force, of: V2/V1, above: 0, below: 1.1}\n"
    more += "  low: {quantity: onset, of: V1, below: 39}\n"
    text = STUDY.replace("samples:", f"{more}samples:")
    assert study(text, tmp_path, monkeypatch, Pretending(crossing)) == 0
    shares = {one["name"]: one["share"] for one in outcome(tmp_path)["statements"]}
    assert shares == {"V2 below V1": 0.0, "between": 0.0, "low": 0.0}


def test_the_logarithm_shares_out_what_spans_decades(tmp_path, monkeypatch):
    def power(trial):
        friction, degree = values(trial)
        force = np.exp(20.0 * friction + 8.0 * degree)
        return {f"shear_force_n_at_deg.{a}": force for a in (10, 20)} | {"wrinkle_onset_deg": 40.0}

    text = STUDY.replace("unit: N,", "unit: N, spacing: log,").replace("samples: 16", "samples: 32")
    assert study(text.replace("[10, 20]", "[10]"), tmp_path, monkeypatch, Pretending(power)) == 0
    found = variable(tmp_path, "V1 force, 10")
    first = [one["first"] for one in found["indices"]]
    assert first == pytest.approx([0.8, 0.2], abs=0.02)  # (20 x 0.4)^2, (8 x 0.5)^2
    assert found["band"][1] == pytest.approx(np.exp(12.0), rel=0.5)


def test_runs_without_a_result_are_recorded_with_their_parameters_and_cost_the_indices(tmp_path, monkeypatch):
    status = "timeout"

    def ends(trial):
        lost = values(trial)[0] > 0.42 and trial.run.fabric.name == "pham2019-v2"
        return status if lost else "completed"

    assert study(STUDY, tmp_path, monkeypatch, Pretending(shearing, ends)) == 3
    found, table = outcome(tmp_path), rows(tmp_path)
    gone = [row for row in table if float(row[FRICTION]) > 0.42]
    assert [row["V2 status"] for row in gone] == [status] * len(gone) and len(gone) == len(found["lost"]) > 8
    assert all(row["V2 reason"] == f"{status} on purpose" and row["V2 force, 10"] == "" for row in gone)
    assert all(one["values"][FRICTION] > 0.42 and one["fabric"] == "V2" for one in found["lost"])
    assert found["lost_share"] == len(gone) / 128 and found["runs_by_status"][status] == len(gone)
    v1, v2, ratio = (variable(tmp_path, f"{who} force, 10") for who in ("V1", "V2", "V2/V1"))
    assert v1["indices"] and v1["count"] == 32
    for one in (v2, ratio):
        assert one["indices"] == [] and one["count"] < 32 and one["band"]
        assert one["no_indices"].startswith(f"{len(gone)} of 64 points of the design have no result")
    assert any("have no valid result" in text for text in found["warnings"])
    assert any("bands of force, onset have different points for each fabric" in text for text in found["warnings"])
    (stated,) = found["statements"]
    assert stated["count"] == v2["count"] and stated["possible"][0] < stated["share"] < stated["possible"][1]


def test_a_number_that_a_run_does_not_have_is_a_lost_one(tmp_path, monkeypatch):
    def short(trial):
        found = shearing(trial)
        if values(trial)[0] > 0.45:
            del found["shear_force_n_at_deg.20"]
        return found

    assert study(STUDY, tmp_path, monkeypatch, Pretending(short)) == 3
    lost = outcome(tmp_path)["lost"]
    assert lost and {one["reason"] for one in lost} == {"no result shear_force_n_at_deg.20"}
    assert variable(tmp_path, "V1 force, 10")["indices"] and not variable(tmp_path, "V1 force, 20")["indices"]


def test_a_draw_that_the_schema_refuses_is_a_lost_run(tmp_path, monkeypatch):
    """Each end of both priors passes alone; together they are stiffer than the thin tube."""
    text = STUDY.replace(f"{DEGREE}: {{low: 0.5, high: 1.0,", "fabric.knitting.beam_diameter: {low: 0.2, high: 0.5,")
    stiff = "fabric.knitting.bending_stiffness: {low: 0.1, high: 99,"
    text = text.replace(f"{FRICTION}: {{low: 0.1, high: 0.5,", stiff)
    results = {"shear_force_n_at_deg.10": 1.0, "shear_force_n_at_deg.20": 2.0, "wrinkle_onset_deg": 3}
    pool = Pretending(lambda trial: results)
    assert study(text, tmp_path, monkeypatch, pool) == 3
    found = outcome(tmp_path)
    assert 0 < found["runs_by_status"]["invalid"] < 128 == found["runs"]
    assert all("thin tube" in one["reason"] and one["trial"] == "" for one in found["lost"])


def test_a_parameter_that_no_result_hangs_on_is_named(tmp_path, monkeypatch, ran):
    def unread(trial):
        return {**shearing(trial), **{f"shear_force_n_at_deg.{a}": values(trial)[0] for a in (10, 20)}}

    assert study(STUDY.replace("samples: 16", "samples: 4"), tmp_path, monkeypatch, Pretending(unread)) == 0
    said = f"no result changes with {DEGREE}: check that this test uses it"
    assert said in outcome(tmp_path)["warnings"] and said not in outcome(ran)["warnings"]
    found = variable(tmp_path, "V1 force, 10")  # four samples are too few
    assert found["band"] == [] and found["no_indices"] == "samples = 4: indices need at least 16"
    assert any("for a band" in text for text in outcome(tmp_path)["warnings"])


def test_the_same_file_goes_on_and_more_samples_keep_what_ran(copied, monkeypatch):
    again = Pretending(shearing)
    other = STUDY.replace("carbon as", "carbon which").replace("below: V1", "above: V1")
    assert study(f"# the same runs\n{other}workers: 2\ntime_limit: 100\n", copied, monkeypatch, again) == 0
    assert again.asked == [] and outcome(copied)["statements"][0]["text"].endswith("V2 above V1 at 10, 20")
    more = Pretending(shearing)
    assert study(STUDY.replace("samples: 16", "samples: 32"), copied, monkeypatch, more) == 0
    assert len(more.asked) == 2 * 4 * 16 and outcome(copied)["points"] == 4 * 32


CHANGES = [
    ("high: 0.5,", "high: 0.4,", "parameters"), ("samples: 16", "samples: 8", "samples"),
    ("samples: 16", "samples: 16\nseed: 2", "seed"), ("variant: 2}", "variant: 1}", "fabrics"),
    ("rig.max_angle: 45", "rig.max_angle: 44", "base"),
]  # fmt: skip


def test_a_changed_file_is_refused_in_the_same_folder(copied, monkeypatch):
    before = outcome(copied)
    for old, new, field in CHANGES:
        with pytest.raises(InputError, match=f"u.yaml: {field} differs from .*uncertainty.yaml: .*--out"):
            study(STUDY.replace(old, new), copied, monkeypatch)
    assert outcome(copied) == before


def test_an_interruption_keeps_what_ran_and_says_what_is_left(tmp_path, monkeypatch):
    few = STUDY.replace("samples: 16", "samples: 4")
    with pytest.raises(Interrupted, match="run the same command again to resume"):
        study(few, tmp_path, monkeypatch, Stopping(11, shearing))
    found = outcome(tmp_path)
    assert found["status"] == "not finished" and found["runs_by_status"] == {"completed": 10, "open": 22}
    pool = Pretending(shearing)
    assert study(few, tmp_path, monkeypatch, pool) == 0
    assert len(pool.asked) == 22 and outcome(tmp_path)["status"] == "finished"


def test_priors_are_drawn_by_their_distribution():
    from knittest.config.studies import Prior
    from knittest.studies.uncertainty.problem import Parameter

    told = {"reason": "a reason of some length"}
    shares = np.array([[0.0, 0.25], [0.5, 1.0]])
    log = Parameter((("a",),), "", Prior(kind="log-uniform", low=0.01, high=1.0, **told), "")
    assert log.values(shares) == pytest.approx(np.array([[0.01, 0.03162278], [0.1, 1.0]]))
    normal = Parameter((("a",),), "", Prior(kind="normal", mean=1.0, sd=1.0, low=0.0, high=2.0, **told), "")
    assert normal.values(shares)[[0, 1, 1], [0, 0, 1]] == pytest.approx([0.0, 1.0, 2.0])
    many = normal.values(design(1, 1024, 1)[0])
    assert many.std() == pytest.approx(0.5397, abs=0.01)  # truncated at one sd on either side
