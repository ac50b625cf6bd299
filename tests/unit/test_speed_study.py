"""Halving the speed of every test: what is halved, the table, and what the report says of it."""

import math
from pathlib import Path
from typing import Any

import pytest

from knittest.base.errors import NumericalError
from knittest.config.loading import resolve
from knittest.experiment import tables
from knittest.experiment.tables import speed_rows
from knittest.laboratory.halved_setting import change, halve_setting
from knittest.studies import speed_study
from knittest.studies.speed_study import CSV, MARKDOWN, SpeedOptions, csv_text, markdown, rows_of, study_command
from knittest.studies.trials.trial import Record

RESULTS = {"pull_force_kinetic_n": 300.0, "mu_paper": 0.15, "wrinkle_onset_deg": math.nan, "residual": 1e-5}


def study(test: str = "friction", scale: str = "macro") -> Any:
    direction = None if test == "picture-frame" else "warp"
    return halve_setting(resolve(variant="1", test=test, scale=scale, direction=direction, preset="quick"))


@pytest.mark.parametrize(
    ("case", "setting"),
    [
        (("tensile", "meso"), "solver.speed"), (("picture-frame", "macro"), "solver.speed"),
        (("cantilever", "macro"), "rig.tolerance"), (("cantilever", "meso"), "solver.safety"),
    ],
)  # fmt: skip
def test_a_strip_at_rest_has_no_speed(case: tuple[str, str], setting: str) -> None:
    found = study(*case)
    part, name = setting.split(".")
    assert found.setting == setting and found.value == getattr(getattr(found.run, part), name)
    assert getattr(getattr(found.half, part), name) == 0.5 * found.value
    same = found.half.model_copy(update={part: getattr(found.run, part)})
    assert same == found.run


def test_changes_are_shares_of_the_result_as_set() -> None:
    assert change(200.0, 190.0) == pytest.approx(-0.05)
    assert change(0.0, 0.0) == 0.0 and change(0.0, 1.0) == math.inf
    assert math.isnan(change(math.nan, 1.0)) and math.isnan(change(1.0, None))


def test_the_table_marks_what_moves_and_reads_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rows = list(rows_of(study(), RESULTS, RESULTS | {"pull_force_kinetic_n": 290.0}))
    assert [row.quantity for row in rows] == ["pull_force_kinetic_n", "mu_paper", "wrinkle_onset_deg"]
    lines = markdown(rows)
    assert "300.0 | 290.0 | **-3.3 %** |" in lines[2] and "| 0.1500 | 0.1500 | +0.00 % |" in lines[3]
    assert lines[4].endswith("| - | - | - |")
    (tmp_path / "simulated").mkdir()
    (tmp_path / "simulated" / CSV).write_text(csv_text(rows, "1"))
    monkeypatch.setattr(tables, "data_dir", lambda: tmp_path)
    force, share, onset = speed_rows("friction", "macro", "pham2019-v1")
    assert (force.variant, force.preset, force.setting) == ("1", "quick", "solver.speed")
    assert (force.result, force.half) == (300.0, 290.0)
    assert share.quantity == "mu_paper" and math.isnan(onset.half)
    assert speed_rows("friction", "meso", "pham2019-v1") == []
    assert speed_rows("friction", "macro", "made-up") == []


def records(status: Any) -> Any:
    def run_all(trials: Any, *_: Any, **__: Any) -> dict[str, Record]:
        def results(label: str) -> dict[str, float]:
            return {"pull_force_kinetic_n": 291.0 if "halved" in label else 300.0}

        return {t.key: Record(t.key, status, "why", {"results": results(t.label)}) for t in trials}

    return run_all


def test_the_command_writes_both_tables(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(speed_study, "run_all", records("completed"))
    assert study_command(SpeedOptions(out=tmp_path, variant="1", tests=("friction",))) == 0
    assert (tmp_path / CSV).read_text().count("pull_force_kinetic_n") == 2
    assert (tmp_path / MARKDOWN).read_text().count("**-3.0 %**") == 2
    assert "2 results, 2 of them change by 2 % or more" in capsys.readouterr().out


def test_no_table_without_all_results(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(speed_study, "run_all", records("failed"))
    with pytest.raises(NumericalError, match="friction macro: failed: why"):
        study_command(SpeedOptions(out=tmp_path, variant="1", tests=("friction",), scales=("macro",)))
