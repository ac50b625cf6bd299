"""Runs that were lost on their way, tried again to shorter ends: which number is whose, and what is said of it."""

import csv
from pathlib import Path

import pytest
from calibration_cases import Pretending
from html_page import HtmlPage
from uncertainty_cases import STUDY, outcome, study, values, variable

from knittest.base.errors import InputError
from knittest.config.yaml_loader import parse_document
from knittest.studies.uncertainty.outcome import Uncertainty
from knittest.studies.uncertainty.page import report_lines
from knittest.studies.uncertainty.problem import problem_of

RESULT = Path("runs/uncertainty-u")
FRICTION = "fabric.contact.friction_coefficient"
ENDS = "shorter_ends: {rig.end_angle: [31, 21, 11]}\n"
REST = "rest: {result: cell_thickness_at_rest_mm, any_end: true}\n  end: {result: cell_thickness_mm}"
FULL = (
    STUDY.replace("picture-frame", "cell")
    .replace("rig.max_angle: 45", "rig.max_angle: 41")
    .replace("shear_force_n_at_deg, at: [10, 20]", "cell_shear_n_per_mm_at_deg, at: [10, 20, 30, 40]")
    .replace("onset: {result: wrinkle_onset_deg, unit: deg}", REST)
    + "design: sample\n"
)  # fmt: skip
SHORTER = FULL + ENDS


def cell(trial) -> dict[str, float]:
    """A cell that is linear in friction, as far as the run goes; V2 above V1 at 20 deg and below it elsewhere."""
    friction, end = values(trial)[0], trial.run.rig.last_angle
    v2 = "v2" in trial.run.fabric.name
    ratio = {a: (1.2 if a == 20 else 0.8) if v2 else 1.0 for a in (10, 20, 30, 40)}
    forces = {f"cell_shear_n_per_mm_at_deg.{a}": a * friction * r for a, r in ratio.items() if a <= end}
    return forces | {"cell_thickness_at_rest_mm": 2.0, "cell_thickness_mm": 2.0 + 0.01 * end}


def reach(trial) -> float:
    """Angle that a cell comes to with all gates passed: V2 with much friction to less than the full one."""
    friction = values(trial)[0] if "v2" in trial.run.fabric.name else 0.0
    return 41.0 if friction < 0.3 else 25.0 if friction < 0.4 else 15.0 if friction < 0.45 else 5.0


def ends(trial) -> str:
    return "completed" if trial.run.rig.last_angle <= reach(trial) else "refused"


def rows() -> list[dict[str, str]]:
    return list(csv.DictReader((RESULT / "results.csv").read_text().splitlines()))


class Counting(Pretending):
    """A pool that keeps the end and label of each trial it was asked for."""

    def __init__(self, results=cell, ends=ends):
        super().__init__(results, ends)
        self.tried: list[tuple[str, float | None]] = []

    def run(self, trials, *arguments):
        self.tried += [(trial.label, trial.run.rig.end_angle) for trial in trials]
        yield from super().run(trials, *arguments)


@pytest.fixture(scope="module")
def ran(tmp_path_factory) -> tuple[Path, Counting]:
    """Folder in which the study ran to its end, and its pool."""
    folder, pool = tmp_path_factory.mktemp("shorter"), Counting()
    with pytest.MonkeyPatch.context() as patch:
        assert study(SHORTER, folder, patch, pool, drawn=True) == 3
    return folder, pool


@pytest.fixture
def here(ran, monkeypatch) -> Path:
    """Folder of the study, as the current one."""
    monkeypatch.chdir(ran[0])
    return ran[0]


def lost_by_reach(rows_: list[dict[str, str]]) -> dict[str, int]:
    """V2's runs by where they count to, as the formula has it."""
    found = {"full": 0, "21": 0, "11": 0, "": 0}
    for row in rows_:
        friction = float(row[FRICTION])
        found["full" if friction < 0.3 else "21" if friction < 0.4 else "11" if friction < 0.45 else ""] += 1
    return found


def test_each_number_is_of_the_longest_run_that_passed_and_none_of_a_refused_one(here):
    table = rows()
    assert min(lost_by_reach(table).values()) >= 3
    for row in table:
        friction, end = float(row[FRICTION]), row["V2 counts to"]
        last = 41.0 if end == "full" else float(end or 0.0)
        for a, share in ((10, 0.8), (20, 1.2), (30, 0.8), (40, 0.8)):
            told = row[f"V2 force, {a}"]
            assert told == "" if a > last else float(told) == pytest.approx(a * friction * share)
        assert row["V1 counts to"] == "full" and row["V1 status"] == "completed"
        ended = ("completed", "") if end == "full" else ("refused", "refused on purpose")
        assert (row["V2 status"], row["V2 reason"]) == ended
    ends_of = [row["V2 counts to"] for row in table]
    assert {end: ends_of.count(end) for end in ("full", "21", "11", "")} == lost_by_reach(table)


def test_counts_say_how_many_numbers_are_of_shorter_runs_at_each_place(here):
    count = lost_by_reach(rows())
    assert variable(here, "V2 rest")["count"] == 32 - count[""]  # any end gives it
    assert variable(here, "V2 end")["count"] == count["full"]  # that at 21 deg is another thickness
    shares = {10: count["21"] + count["11"], 20: count["21"], 30: 0, 40: 0}
    for a, shortened in shares.items():
        for who in ("V2", "V2/V1"):
            found = variable(here, f"{who} force, {a}")
            assert (found["count"], found["shortened"]) == (count["full"] + shortened, shortened)
        assert variable(here, f"V1 force, {a}")["shortened"] == 0


def test_a_lost_run_says_why_the_full_one_was_and_where_the_one_that_counts_ends(here):
    found, table = outcome(here), rows()
    assert len(found["lost"]) == 32 - lost_by_reach(table)["full"] and found["runs"] == 64
    for one in found["lost"]:
        friction = one["values"][FRICTION]
        end = 21.0 if friction < 0.4 else 11.0 if friction < 0.45 else None
        assert (one["status"], one["reason"], one["counts_to"]) == ("refused", "refused on purpose", end)
        tried = [(t["end"], t["status"]) for t in one["tried"]]
        expected = [(31.0, "refused"), (21.0, "completed" if end == 21.0 else "refused")]
        assert tried[:2] == expected and len(tried) == (2 if end == 21.0 else 3)
        row = table[one["point"] - 1]
        assert row["V2 folder"] == f"trials/{one['tried'][-1]['trial'] if end else one['trial']}"


def test_runs_to_shorter_ends_are_counted_by_status_and_warned_of(here):
    found, count = outcome(here), lost_by_reach(rows())
    lost = 32 - count["full"]
    assert found["runs_by_status"] == {"completed": 64 - lost, "refused": lost} and found["status"] == "finished"
    by = {one["end"]: one["runs_by_status"] for one in found["shorter"]}
    left = lost - count["21"]
    assert by == {
        31.0: {"refused": lost}, 21.0: {"refused": left, "completed": count["21"]},
        11.0: {"completed": count["11"], "refused": left - count["11"]},
    }  # fmt: skip
    assert (found["shorter_field"], found["shorter_unit"]) == ("rig.end_angle", "deg")
    said = " ".join(found["warnings"])
    ends_ = f"({count['21']} to 21 deg, {count['11']} to 11 deg)"
    assert f"{count['21'] + count['11']} of these count to a shorter end {ends_}" in said
    assert "bands of force, rest, end have different points for each fabric" in said
    assert "bands of force have different points at each place" in said
    lines = report_lines(Uncertainty.model_validate(found))
    (told,) = [line for line in lines if line.startswith(f"  failed runs repeated to 21 deg: {lost} (")]
    assert f"{count['21']} completed" in told and f"{left} refused" in told
    assert any(f"({count['full'] + count['21']} of 32, {count['21']} shortened points)" in line for line in lines)


def test_a_statement_is_open_where_a_place_is_missing_unless_it_fails_at_another(here):
    """V2 is above V1 at 20 deg: points that came so far fail, those that came to 10 deg alone are open."""
    found, count = outcome(here)["statements"][0], lost_by_reach(rows())
    assert found["text"] == "force of V2 below V1 at 10, 20, 30, 40"
    assert (found["count"], found["share"], found["failing"]) == (count["full"], 0.0, count["21"])
    assert found["possible"] == [0.0, (count["11"] + count[""]) / 32]
    said = HtmlPage(RESULT / "report.html").text()
    assert (
        f"for any result of the other {32 - count['full']}, {count['21']} of which fail at a place with a result"
        in said
    )


def test_the_page_shows_where_lost_runs_count_to_and_whose_numbers_bands_are_of(here):
    page, count = HtmlPage(RESULT / "report.html"), lost_by_reach(rows())
    page.check()
    bands = page.tables(page.section("bands"))["Percentiles over the prior"]
    by = {row[0]: row[4] for row in bands[1:]}
    assert by["V2 force, 20"] == f"{count['full'] + count['21']} of 32, {count['21']} shortened"
    ((_, lost),) = page.tables(page.section("lost")).items()
    assert lost[0][3] == "counts to [deg]" and any(row[3].startswith("21") for row in lost[1:])
    assert "31: refused on purpose" in page.text(page.section("lost"))
    assert "to 31 deg" in page.text(page.section("summary"))


def test_only_what_was_lost_runs_again_each_end_once_and_after_the_one_before(ran):
    tried = ran[1].tried
    assert [end for _, end in tried[:64]] == [None] * 64
    again = [end for _, end in tried[64:]]
    assert again == sorted(again, reverse=True) and len(ran[1].asked) == len(set(ran[1].asked)) == len(tried)
    assert tried[64][0].endswith(", to 31")


def test_a_finished_folder_goes_on_with_shorter_ends_and_without_them(tmp_path, monkeypatch):
    assert study(FULL, tmp_path, monkeypatch, Counting()) == 3
    before, alone = variable(tmp_path, "V2 force, 10"), Counting()
    assert before["shortened"] == 0 and "V2 counts to" not in rows()[0]
    assert study(SHORTER, tmp_path, monkeypatch, alone) == 3
    assert alone.tried and {end for _, end in alone.tried} == {31.0, 21.0, 11.0}
    assert variable(tmp_path, "V2 force, 10")["count"] > before["count"]
    for text in (SHORTER, FULL):
        nothing = Counting()
        assert study(text, tmp_path, monkeypatch, nothing) == 3 and nothing.tried == []
    assert variable(tmp_path, "V2 force, 10") == before


@pytest.mark.parametrize("status", ["invalid", "timeout", "crashed", "blocked", "error"])
def test_what_no_shorter_way_would_change_is_not_run_again(tmp_path, monkeypatch, status):
    pool = Counting(ends=lambda trial: "completed" if reach(trial) > 40.0 else status)
    assert study(SHORTER.replace("samples: 16", "samples: 4"), tmp_path, monkeypatch, pool) == 3
    assert {end for _, end in pool.tried} == {None}
    assert all(one["counts_to"] is None and one["tried"] == [] for one in outcome(tmp_path)["lost"])


def test_an_interruption_among_the_shorter_runs_leaves_them_open(tmp_path, monkeypatch):
    class Ending(Counting):
        def run(self, trials, *arguments):
            for record in super().run(trials, *arguments):
                if trials[0].run.rig.end_angle == 21.0:
                    raise KeyboardInterrupt
                yield record

    few = SHORTER.replace("samples: 16", "samples: 8")
    with pytest.raises(KeyboardInterrupt):
        study(few, tmp_path, monkeypatch, Ending())
    found = outcome(tmp_path)
    by = {one["end"]: one["runs_by_status"] for one in found["shorter"]}
    assert found["status"] == "not finished" and set(by[21.0]) == {"open"} and by[11.0] == {}
    pool = Counting()
    assert study(few, tmp_path, monkeypatch, pool) == 3
    assert {end for _, end in pool.tried} == {21.0, 11.0} and outcome(tmp_path)["status"] == "finished"


def test_numbers_of_failed_ones_that_all_come_shorter_end_with_3_still(tmp_path, monkeypatch):
    """Places up to 20 deg alone: no number is missing, and yet the full runs did not pass."""
    text = SHORTER.replace("10, 20, 30, 40", "10, 20").replace("  end: {result: cell_thickness_mm}\n", "")
    pool = Counting(ends=lambda trial: "failed" if trial.run.rig.end_angle is None else "completed")
    assert study(text.replace("samples: 16", "samples: 2"), tmp_path, monkeypatch, pool) == 3
    found = outcome(tmp_path)
    assert {one["counts_to"] for one in found["lost"]} == {31.0} and variable(tmp_path, "V1 force, 20")["count"] == 4


@pytest.mark.parametrize(
    ("ends_", "said"),
    [
        ("rig.max_angl: [31]", "u.yaml:18: rig.max_angl: "),
        ("rig.max_angle: [31]", "rig.max_angle: does not end this test (cell) sooner: expected rig.end_angle"),
        ("solver.speed: [1]", "u.yaml:18: solver.speed: expected a field of the fabric or the rig"),
        ("rig.end_angle: []", "u.yaml:18: shorter_ends.rig.end_angle"),
        ("rig.end_angle: [21, 0]", "u.yaml:18: shorter_ends.rig.end_angle"),
        ("rig.end_angle: [45, 21]", "u.yaml:18: shorter_ends.rig.end_angle = [45, 21]: 45 must be below the full end"),
        ("rig.end_angle: [21, 31]", "31 must be below the value before it, 21"),
        ("rig.end_angle: [31, 20.2]", "20.2 is within the range of the mean at 20, which ends at 20.5"),
        ("rig.end_angle: [21], rig.max_angle: [30]", "u.yaml:18: shorter"),
    ],
)  # fmt: skip
def test_ends_that_are_none_are_refused_where_they_stand(ends_, said):
    assert said in refusal(FULL + f"shorter_ends: {{{ends_}}}\n")


def refusal(text: str) -> str:
    with pytest.raises(InputError) as caught:
        problem_of(parse_document(text, "u.yaml"))
    return str(caught.value)


def test_ends_are_refused_that_give_nothing_are_drawn_or_belong_to_no_such_test():
    low = SHORTER.replace("21, 11", "21, 5")
    assert "a run to 5 has none of the requested results: the first place is 10" in refusal(
        low.replace(", any_end: true", "")
    )
    assert problem_of(parse_document(low, "u.yaml")).shorter.values == (31.0, 21.0, 5.0)
    just = SHORTER.replace("21, 11", "20.5")
    assert problem_of(parse_document(just, "u.yaml")).shorter.values == (31.0, 20.5)
    drawn = "parameters:\n  rig.end_angle: {low: 20, high: 40, reason: a reason of some length}\n"
    assert "is also one of the parameters" in refusal(SHORTER.replace("parameters:\n", drawn))
    frame = STUDY + "shorter_ends: {rig.max_angle: [21]}\n"
    assert "does not end this test (picture-frame) sooner: the test has results only at its end" in refusal(frame)
    placed = SHORTER.replace("[10, 20, 30, 40],", "[10, 20, 30, 40], any_end: true,")
    assert "quantities.force.any_end" in refusal(placed)
    less = SHORTER.replace("rig.max_angle: 41", "rig.max_angle: 41, rig.end_angle: 25")
    assert "31 must be below the full end of V1, 25" in refusal(less)
