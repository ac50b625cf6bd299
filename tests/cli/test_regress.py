"""``knittest regress``: what passes, what fails, what it leaves."""

import json
import math
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from regress_cases import CPU_S, ELEMENTS, UNPUBLISHED, Pretending

from knittest.base.kinds import kinds
from knittest.cli.main import run
from knittest.studies.regress import baseline, cases, command
from knittest.studies.regress.cases import Case, cases_of, select_cases
from knittest.studies.regress.drift import RUNS
from knittest.studies.regress.published_tables import table3_rows, table4_rows, total_hours
from knittest.studies.trials.trial import Record

TENSILE = "tensile-macro-v1-warp-quick"
FORMING, YARNS = "forming-macro-v1-quick-100n", "picture-frame-meso-v1-quick-20mm"
FRAME = "picture-frame-macro-v1-quick"


def few_cases(level):
    """Cases of a level, of the quick one every kind of judgement but not every run, so that the tests stay fast."""
    rows = ("tensile-macro", "cantilever-macro", "friction-macro-v1-warp", "tensile-meso-v1-weft")
    others = (FORMING, YARNS, FRAME, "bias-extension-macro-v1", "biaxial-macro-v1-warp")
    return [case for case in cases_of(level) if level == "full" or case.name.startswith((*rows, *others))]


@pytest.fixture
def regress(tmp_path, monkeypatch):
    """Runs the command in an empty folder with a pool that pretends; ``out`` is new each time."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cases, "cases_of", few_cases)
    count = iter(range(100))

    def call(*arguments, pool=None, out=None):
        monkeypatch.setattr(command, "LocalPool", lambda *numbers: call.shares.append(numbers) or pool or Pretending())
        return run(["regress", "--baseline", "b.json", "--out", out or f"out{next(count)}", *arguments])

    call.shares = []
    return call


@pytest.fixture
def stored(regress):
    """The same with a baseline ``b.json`` of the pretended runs."""
    assert regress("--update-baseline", "--quiet") == 0
    return regress


def changed(*path, factor, case=TENSILE):
    """Multiply the number at ``path`` of an entry of the baseline, by default that of the tensile test."""
    file = Path("b.json")
    data = json.loads(file.read_text())
    holder = data["entries"][case]
    for key in path[:-1]:
        holder = holder[key]
    holder[path[-1]] = type(holder[path[-1]])(holder[path[-1]] * factor)
    file.write_text(json.dumps(data))


def test_all_as_published_passes_and_says_what_it_is_worth(stored, capsys):
    assert stored() == 0
    text = capsys.readouterr().out
    assert "PASS: rows that pass: 1 of 1 predicted, 9 of 9 tuned, 9 of 9 input" in text
    assert re.search(
        r"V1 warp +macro +quick +peak force \[N\] +5820 +5820 ± 461 +\+0.00 sd +input +within 1 % +pass", text
    )
    assert re.search(r"V2 weft +macro +quick +overhang \[mm\] .* tuned +within 1 sd +pass", text)
    assert re.search(rf"tensile +macro +440 +{ELEMENTS} +0.067 +{CPU_S / 3600.0:.2g} +5000 +12 +preset quick", text)
    assert "other machines than in the paper" in text
    assert re.search(rf"forming +macro +27512 +{ELEMENTS} +384 +{CPU_S / 3600.0:.2g} +5000 +12 +preset quick", text)
    assert re.search(r"cantilever +meso +\d+ +- +[\d.]+ +- +- +- +not run at this level", text)


def test_rows_off_by_more_than_their_limits_fail(stored, capsys):
    assert stored(pool=Pretending(1.05)) == 5
    text = capsys.readouterr().out
    assert re.search(r"V1 warp +macro +quick +peak force .* input +within 1 % +FAIL: 5.00 % off the input", text)
    assert re.search(r"V2 weft +macro +quick +overhang .* tuned +within 1 sd +FAIL: 1.21 sd off the mean", text)
    assert re.search(r"V1 weft +meso +quick +peak force .* tuned +within 1 sd +pass", text)
    assert "FAIL: rows that pass: 1 of 1 predicted, 4 of 9 tuned, 0 of 9 input" in text
    assert f"FAIL {TENSILE}: peak_force_n: 5820 stored, 6111 now (+5 %, limit 0.1 %)" in text
    stored("--sd", "1.3", pool=Pretending(1.05))
    assert re.search(r"V2 weft +macro +quick +overhang .* tuned +within 1.3 sd +pass", capsys.readouterr().out)


PEAK, MIDDLE = ("results", "peak_force_n"), ("curve", "y", 10)


@pytest.mark.parametrize(
    ("path", "factor", "code"),
    [(PEAK, 1.0015, 5), (PEAK, 1.0005, 0), (MIDDLE, 1.005, 5), (MIDDLE, 1.001, 0), (("elements",), 1.01, 5)],
)
def test_drift_counts_beyond_its_limit(stored, path, factor, code, capsys):
    changed(*path, factor=factor)
    assert stored() == code
    assert ("FAIL" in capsys.readouterr().out) == (code == 5)


def scattered(case, **spread):
    """Results of the runs of ``case`` that round differently: by turns 1 and -1 times ``spread`` off the first's."""
    numbers = UNPUBLISHED[next(kind for kind in UNPUBLISHED if case.startswith(kind))]
    return {
        f"{case}, rounding {k}": {name: numbers[name] + (-1) ** k * off for name, off in spread.items()}
        for k in range(1, RUNS)
    }


@pytest.mark.parametrize(("factor", "code"), [(1.04, 0), (1.07, 5), (0.96, 0), (0.93, 5)])
def test_a_number_may_be_off_by_five_times_its_scatter(regress, factor, code, capsys):
    """109 N, and eleven runs by turns 1.09 N below and above: 5.2 %; a number without scatter has 0.1 % still."""
    pool = Pretending(more=scattered(FORMING, stamp_force_max_n=1.09))
    assert regress("--update-baseline", "--quiet", pool=pool) == 0
    changed("results", "stamp_force_max_n", factor=factor, case=FORMING)
    assert regress() == code
    text = capsys.readouterr().out
    assert (f"FAIL {FORMING}: stamp_force_max_n" in text) == (code == 5)
    assert re.search(r"5 times the scatter of 12 runs .* in all at most [45]\.\d % \(stamp_force_max_n", text)
    changed("results", "max_wrinkle_height_mm", factor=1.002, case=FORMING)
    assert regress() == 5


def test_only_what_enlarges_rounding_runs_several_times_and_only_to_be_stored(stored):
    def asked(*arguments):
        pool = Pretending()
        assert stored("--quiet", *arguments, pool=pool) == 0
        return pool.asked

    again = [label for label in asked("--update-baseline") if ", rounding " in label]
    frames = {YARNS, f"{YARNS}-spin-friction", FRAME}
    assert {label.split(",")[0] for label in again} == {FORMING} | frames and len(again) == 4 * (RUNS - 1)
    assert not [label for label in asked() if ", rounding " in label]


def test_a_run_that_rounding_refuses_is_not_stored_and_fails(stored, capsys):
    before = Path("b.json").read_text()
    pool = Pretending(1.01, ends=lambda trial: "refused" if trial.label == f"{FORMING}, rounding 3" else "completed")
    assert stored("--update-baseline", "--scale", "macro", pool=pool) == 5
    text = capsys.readouterr().out
    assert f"FAIL {FORMING}: not stored: {FORMING}, rounding 3, the same run with other rounding, refused" in text
    assert "a run at the limit of a quality check is no baseline" in text
    assert json.loads(before)["entries"][FORMING] == json.loads(Path("b.json").read_text())["entries"][FORMING]


FORCE, HEIGHT = ("results", "stamp_force_max_n"), ("results", "max_wrinkle_height_mm")


@pytest.mark.parametrize(
    ("path", "factor", "code"),
    [(FORCE, 1.05, 5), (FORCE, 1.03, 0), (HEIGHT, 1.08, 0), (HEIGHT, 1.15, 5), (MIDDLE, 1.05, 5)],
)
def test_what_enlarges_rounding_at_a_price_has_limits_of_its_own(regress, path, factor, code, capsys):
    """Runs of the full level that are too long for a dozen."""
    name = "forming-macro-v1-paper-100n"
    level = ("--level", "full", "--table", "4", "--scale", "macro")
    assert regress(*level, "--update-baseline", "--quiet") == 0
    changed(*path, factor=factor, case=name)
    assert regress(*level) == code
    text = capsys.readouterr().out
    assert (f"FAIL {name}" in text) == (code == 5)
    assert f"{name}, which amplifies rounding: 4 %, 2 %, buckles 10 %" in text


@pytest.mark.parametrize("gone", [None, "nan"])
def test_a_number_without_value_is_neither_stored_nor_passes(stored, gone, capsys):
    """The onset of wrinkles is none where nothing wrinkles."""
    lost = {"wrinkle_onset_deg": None if gone is None else float(gone)}
    assert stored("--update-baseline", "--quiet", pool=Pretending(more={YARNS: lost})) == 0
    file = Path("b.json")
    data = json.loads(file.read_text())
    assert "wrinkle_onset_deg" not in data["entries"][YARNS]["results"]
    data["entries"][YARNS]["results"]["wrinkle_onset_deg"] = 12.0
    data["entries"][YARNS]["scatter"]["wrinkle_onset_deg"] = 0.0
    file.write_text(json.dumps(data))
    assert stored(pool=Pretending(more={YARNS: lost})) == 5
    assert f"FAIL {YARNS}: wrinkle_onset_deg: 12 stored, nan now" in capsys.readouterr().out
    assert stored("--update-baseline", pool=Pretending(more={YARNS: lost})) == 5
    text = "not stored: limits would grow by more than 30 %: wrinkle_onset_deg 1 % to none, as it is missing"
    assert f"FAIL {YARNS}: {text}" in capsys.readouterr().out


def test_a_run_without_result_fails_with_its_reason(stored, capsys):
    pool = Pretending(ends=lambda trial: "refused" if trial.label == TENSILE else "completed")
    assert stored(pool=pool) == 5
    text = capsys.readouterr().out
    assert "FAIL: run refused: refused with a bell" in text
    assert f"FAIL {TENSILE}: run refused" in text


def test_update_rewrites_with_provenance_and_keeps_what_did_not_complete(stored, capsys):
    before = baseline.load(Path("b.json"))
    pool = Pretending(1.001, lambda trial: "timeout" if trial.label == TENSILE else "completed")
    assert stored("--update-baseline", pool=pool) == 5
    after = baseline.load(Path("b.json"))
    other = "tensile-macro-v2-warp-quick"
    assert after.entries[TENSILE] == before.entries[TENSILE]
    assert after.entries[other].results["peak_force_n"] == pytest.approx(5805.8)
    assert after.entries[other].cpu and after.entries[other].date.startswith("20")
    assert f"{other}: " in capsys.readouterr().out


def test_finished_runs_are_not_repeated(stored):
    pool = Pretending()
    assert stored("--quiet", pool=pool, out="same") == 0
    assert len(pool.asked) == len(few_cases("quick"))
    again = Pretending()
    assert stored("--quiet", pool=again, out="same") == 0
    assert again.asked == []


def test_choice_of_table_scale_and_level(stored):
    def labels(*arguments):
        pool = Pretending()
        stored(*arguments, "--quiet", pool=pool)
        return pool.asked

    assert labels("--scale", "meso") == ["tensile-meso-v1-weft-quick", YARNS, f"{YARNS}-spin-friction"]
    assert sorted(labels("--table", "4", "--scale", "macro")) == [
        "cantilever-macro-v1-warp-quick", FORMING, "friction-macro-v1-warp-quick", "picture-frame-macro-v1-quick",
        TENSILE,
    ]  # fmt: skip
    full = labels("--level", "full", "--scale", "macro")
    assert "picture-frame-macro-v1-paper" in full and len(full) == 14


def test_table_4_has_all_runs_of_the_paper_at_its_size_two_at_a_time_on_one_thread(stored, capsys):
    assert stored("--table", "4", "--level", "full", "--update-baseline") == 0
    assert stored.shares == [(None, None), (2, 1)]
    lines = capsys.readouterr().out.splitlines()
    rows = [line for line in lines if re.search("preset paper, (100n, )?quality checks passed", line)]
    assert len(rows) == 10 and all(" 5000 " in row and " 12 " in row for row in rows)
    assert "sum of the tests that ran: 4011 CPU h in the paper, 0.1 here" in lines


def test_a_run_that_gates_refuse_has_its_cost_and_says_so():
    case = select_cases("full", "macro", 4)[0]
    summary = {"cost": {"elements": 7, "cpu_s": 36.0, "steps": 9}, "quality": {"added_mass_pct": None}}
    [row] = [r for r in table4_rows({case: Record("k", "refused", "why", summary)}) if r.elements == 7]
    assert (row.test, row.cpu_h, row.note) == (case.test, 0.01, "preset paper, 100n, refused") and math.isnan(
        row.added_mass
    )
    assert total_hours([row]) == (row.paper_cpu_h, 0.01)


def test_a_run_without_an_entry_fails_as_nothing_judges_it(stored, capsys):
    assert stored("--level", "full", "--scale", "macro", "--junit", "j.xml") == 5
    said = (
        "FAIL picture-frame-macro-v1-paper: not in the baseline, so it is not compared: store it with --update-baseline"
    )
    assert said in capsys.readouterr().out
    assert len(ET.parse("j.xml").findall(".//failure")) == 14


def test_junit_can_be_read_back(stored):
    pool = Pretending(1.005, lambda trial: "failed" if trial.label == TENSILE else "completed")
    assert stored("--quiet", "--junit", "j.xml", pool=pool) == 5
    table, drift = ET.parse("j.xml").getroot().findall("testsuite")
    assert (table.get("name"), table.get("tests"), table.get("failures")) == ("table 3", "19", "2")
    failed = {case.get("name") for case in table if case.find("failure") is not None}
    assert failed == {"V1 warp peak_force_n (input)", "V1 warp fracture_strain_pct (input)"}
    assert (drift.get("tests"), drift.get("failures")) == ("16", "13")  # 0.5 %: within the limits of yarns
    assert float(drift.get("time")) == pytest.approx(15 * 2.0 + 1.0)


def test_json_is_one_object_alone(stored, capsys):
    assert stored("--json", "--quiet", pool=Pretending(1.05), out="here") == 5
    data = json.loads(capsys.readouterr().out)
    assert (data["passed"], data["exit_code"], data["level"]) == (False, 5, "quick")
    row = next(r for r in data["table3"] if r["run"] == TENSILE and r["quantity"] == "peak_force_n")
    assert row["kind"] == "input" and not row["passed"] and row["deviation_sd"] == pytest.approx(0.631, abs=1e-3)
    assert json.loads(Path("here/regress.json").read_text()) == data


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--baseline", "none.json"], "none.json: no baseline"),
        (["--baseline", "text.json"], "text.json: no baseline of this version"),
        (["--baseline", "next.json"], "format"),
        (["--junit", "nowhere/j.xml"], "nowhere/j.xml: expected a file in an existing folder"),
        (["--out", "taken"], "holds thesis.txt, but no regression"),
        (["--out", "text.json"], "is a file"),
    ],
)
def test_bad_input_ends_with_2_before_anything_runs(stored, arguments, said, capsys):
    Path("text.json").write_text("nothing")
    Path("next.json").write_text('{"format": 2, "entries": {}}')
    Path("taken").mkdir()
    Path("taken/thesis.txt").write_text("")
    pool = Pretending()
    assert stored(*arguments, pool=pool) == 2
    assert said in capsys.readouterr().err
    assert pool.asked == []


def test_a_reduced_run_has_no_row_of_table_3():
    """A strip on a third of the plates is not the paper's test."""
    (strip,) = (case for case in cases_of("quick") if case.name.startswith("friction-meso-v1-warp"))
    whole = Case("friction", "meso", "1", "warp", "quick")
    done = Record("k", "completed", summary={"results": {"mu_paper": 0.15}})
    assert [row.quantity for row in table3_rows(whole, whole.trial().run, done, 1.0)] == ["mu_paper"]
    assert list(table3_rows(strip, strip.trial().run, done, 1.0)) == []
    assert (whole.tables, strip.tables) == ((3, 4), (4,))


def test_a_case_runs_the_parameter_set_that_its_name_ends_with():
    """The default set and crossings that resist spin."""
    frames = {case.name: case.trial().run for case in cases_of("quick") if case.name.startswith(YARNS)}
    assert {name: run.parameters for name, run in frames.items()} == {
        YARNS: "calibrated",
        f"{YARNS}-spin-friction": "spin-friction",
    }
    assert [run.fabric.contact.patch is None for run in frames.values()] == [True, False]


def test_ci_runs_the_regression_for_real():
    """Quick level, against the shipped baseline, on the checkout's code; its exit code is that of the script."""
    script = (Path(__file__).parents[2] / ".ci/run").read_text()
    (line,) = (line for line in script.splitlines() if "bin/knittest regress" in line and not line.startswith("#"))
    assert "set -eu" in script.splitlines()
    assert not re.search(r"[|&;!]|^\s*if |--baseline|--update-baseline|--scale|--table|--sd|--level full", line), line


def test_shipped_baseline_knows_every_run_and_no_other():
    known = baseline.load(baseline.shipped_path()).entries
    assert cases.all_names() == set(known)
    assert all(entry.commit and not entry.commit.endswith("-dirty") for entry in known.values())
    for case in (case for level in cases.LIMITS for case in cases_of(level)):
        entry, crests = known[case.name], set(kinds()[case.test].regression.crests)
        assert (entry.runs == RUNS) == case.enlarges and (entry.curve is None) == (case.test == "cantilever")
        assert set(entry.ranges) == (crests if case.enlarges else set())


def test_the_code_has_not_drifted(tmp_path, monkeypatch):
    one = Case("tensile", "macro", "1", "warp", "quick")
    monkeypatch.setattr(cases, "cases_of", lambda level: [one])
    kept = {one.name: baseline.load(baseline.shipped_path()).entries[one.name]}
    baseline.save(tmp_path / "b.json", baseline.Baseline(entries=kept))
    where = ["--out", str(tmp_path / "out"), "--baseline", str(tmp_path / "b.json")]
    assert run(["regress", *where, "--workers", "1", "--threads", "1", "--quiet"]) == 0
    (drift,) = json.loads((tmp_path / "out" / "regress.json").read_text())["drift"]
    assert drift["judged"] and len(drift["changes"]) >= 4
