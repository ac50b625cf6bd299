"""Optuna searches, keeps its trials in a database, goes on with them, and says what is wrong with one."""

import importlib.util
import socket
import sys
import types
from pathlib import Path

import pytest
from calibration_cases import TWO, WARP, WEFT, Pretending, Stopping, calibrate, outcome, values

from knittest.base.errors import InputError, ResourceError
from knittest.base.interrupts import Interrupted
from knittest.cli.main import run as knittest
from knittest.studies.calibrate import command, optuna_search
from knittest.studies.calibrate.command import CalibrateOptions, run_calibration

optuna = pytest.importorskip("optuna")

OPTUNA = TWO + "method: optuna\nmax_runs: 80\n"
RESULT = Path("runs/calibrate-c")
WIDE = 0.02 * 3 * 51 / 171


@pytest.fixture(autouse=True)
def without_pictures(monkeypatch):
    """Only its database is looked at here."""
    monkeypatch.setattr(command, "convergence_picture", lambda *arguments: None)
    monkeypatch.setattr(command, "write_if_possible", lambda *arguments: None)


def study(folder: Path, url: str | None = None):
    """The only study of a calibration in ``folder``."""
    url = url or f"sqlite:///{folder / RESULT / 'optuna.db'}"
    (name,) = optuna.get_all_study_names(url)
    return optuna.load_study(study_name=name, storage=url)


def stiffness(trial) -> float:
    return trial.run.fabric.macro.bending_stiffness.warp.value


def test_several_parameters_are_found_and_kept(tmp_path, monkeypatch):
    assert calibrate(OPTUNA, tmp_path, monkeypatch, Pretending()) == 0
    found = outcome(tmp_path)
    assert values(tmp_path) == pytest.approx([WARP, WEFT], rel=WIDE) and found["method"] == "optuna"
    assert found["rms_deviation_sd"] <= 0.02 and found["runs"] <= 80
    kept = study(tmp_path)
    assert len(kept.trials) == 24 and kept.trials[0].params["fabric.macro.bending_stiffness.warp"] == 2.0
    by_point = {tuple(one["values"]): one for one in found["evaluations"]}
    best = by_point[tuple(float(f"{v:.8g}") for v in kept.best_params.values())]
    deviations = [(best["simulated"][0] - 171) / 51, (best["simulated"][1] - 151) / 15]
    assert kept.best_value == pytest.approx(sum(d**2 for d in deviations), rel=1e-6)


def test_an_interrupted_search_goes_on_without_repeating(tmp_path, monkeypatch):
    first, second, third, whole = Stopping(22), Pretending(), Pretending(), Pretending()
    with pytest.raises(Interrupted, match="run the same command again to resume"):
        calibrate(OPTUNA, tmp_path, monkeypatch, first)
    running = [t.number for t in study(tmp_path).trials if t.state == optuna.trial.TrialState.RUNNING]
    assert running == [8, 9, 10, 11]
    assert calibrate(OPTUNA, tmp_path, monkeypatch, second) == 0
    assert not set(first.asked[:-1]) & set(second.asked) and first.asked[-1] in second.asked
    kept = study(tmp_path)
    assert len(kept.trials) == 24 and all(t.state == optuna.trial.TrialState.COMPLETE for t in kept.trials)
    again = outcome(tmp_path)["evaluations"]
    assert calibrate(OPTUNA, tmp_path, monkeypatch, third) == 0
    assert third.asked == [] and outcome(tmp_path)["evaluations"] == again and len(study(tmp_path).trials) == 24
    (tmp_path / RESULT / "optuna.db").unlink()  # the ledger alone is enough: the same seed asks the same
    assert calibrate(OPTUNA, tmp_path, monkeypatch, whole) == 0 and len(whole.asked) < 20
    assert values(tmp_path) == pytest.approx([WARP, WEFT], rel=WIDE)


@pytest.mark.parametrize(("status", "state"), [("timeout", "PRUNED"), ("crashed", "FAIL")])
def test_a_lost_trial_is_in_the_database_with_its_reason(tmp_path, monkeypatch, status, state):
    lost = Pretending(ends=lambda trial: status if stiffness(trial) > 6.0 else "completed")
    assert calibrate(OPTUNA, tmp_path, monkeypatch, lost) == 0
    assert values(tmp_path) == pytest.approx([WARP, WEFT], rel=WIDE)
    gone = [t for t in study(tmp_path).trials if t.params["fabric.macro.bending_stiffness.warp"] > 6.0]
    assert gone and all(t.state.name == state and t.value is None for t in gone)
    reason = f"one {status}: {status} on purpose; other {status}: {status} on purpose"
    assert {t.user_attrs["reason"] for t in gone} == {reason}


@pytest.mark.parametrize(
    ("url", "code", "said"),
    [
        ("nonsense", 2, "--storage: not the URL of a known database: Could not parse"),
        ("klingon://here/x", 2, "--storage: not the URL of a known database: Can't load plugin"),
        ("sqlite:////no/such/folder/x.db", 4, "the database does not answer: unable to open database file"),
        ("sqlite:///text.db", 4, "the database does not answer: file is not a database"),
    ],
)
def test_a_broken_database_is_told_before_anything_runs(tmp_path, monkeypatch, capsys, url, code, said):
    monkeypatch.chdir(tmp_path)
    Path("c.yaml").write_text(OPTUNA)
    Path("text.db").write_text("this is no database, but a text of some length\n" * 50)
    assert knittest(["calibrate", "c.yaml", "--storage", url]) == code
    assert said in capsys.readouterr().err and not Path("runs").exists()


def test_a_missing_driver_or_server_is_named_without_the_password(monkeypatch):
    monkeypatch.setitem(sys.modules, "psycopg2", None)
    with pytest.raises(InputError, match=r"//me:\*\*\*@h/n: the driver of this database is not installed: .*psycopg2"):
        optuna_search.open_storage("postgresql+psycopg2://me:secret@h/n", "--storage")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    driver = types.ModuleType("psycopg2")
    driver.paramstyle, driver.__version__ = "pyformat", "2.9.9"
    monkeypatch.setitem(sys.modules, "psycopg2", driver)
    with pytest.raises(ResourceError, match=f"no answer from 127.0.0.1:{port}: .*refused") as caught:
        optuna_search.open_storage(f"postgresql+psycopg2://me:secret@127.0.0.1:{port}/n", "--storage")
    assert "secret" not in str(caught.value)


def test_a_lost_database_keeps_what_is_finished(tmp_path, monkeypatch):
    class Breaking(Pretending):
        def run(self, *arguments):
            yield from super().run(*arguments)
            if len(self.asked) >= 8:
                (tmp_path / RESULT / "optuna.db").write_bytes(b"broken " * 4000)

    with pytest.raises(ResourceError, match="finished runs are kept"):
        calibrate(OPTUNA, tmp_path, monkeypatch, Breaking())
    (tmp_path / RESULT / "optuna.db").unlink()
    second = Pretending()
    assert calibrate(OPTUNA, tmp_path, monkeypatch, second) == 0
    assert values(tmp_path) == pytest.approx([WARP, WEFT], rel=WIDE)


def test_another_database_is_used_where_it_belongs_if_optuna_is_installed(tmp_path, monkeypatch):
    url = f"sqlite:///{tmp_path}/shared.db"
    assert calibrate(f"{OPTUNA}storage: {url}\n", tmp_path, monkeypatch, Pretending()) == 0
    assert len(study(tmp_path, url).trials) == 24 and not (tmp_path / RESULT / "optuna.db").exists()
    with pytest.raises(InputError, match=r"c.yaml:12: storage: only method = optuna uses a database"):
        calibrate(OPTUNA.replace("method: optuna", "storage: sqlite://"), tmp_path, monkeypatch, Pretending())
    (tmp_path / "c.yaml").write_text(OPTUNA.replace("method: optuna", ""))
    with pytest.raises(InputError, match="--storage: only method = optuna uses a database, not least-squares"):
        run_calibration(tmp_path / "c.yaml", CalibrateOptions(storage="sqlite://"))
    found = importlib.util.find_spec
    monkeypatch.setattr(command, "find_spec", lambda name: None if name == "optuna" else found(name))
    with pytest.raises(InputError, match=r"Optuna is not installed: pip install 'knittest\[calibrate\]'"):
        calibrate(OPTUNA, tmp_path, monkeypatch, Pretending())
