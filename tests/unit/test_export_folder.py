"""The run folder: manifest, lock, atomic files, and nothing half-written that looks like a result."""

import errno
import hashlib
import json
import math
import os
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from export_sample import cost, curve, quality

from knittest.base import files
from knittest.base.errors import InputError, NumericalError, OutOfTolerance, ResourceError
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.export import lock
from knittest.export.folder import RunFolder
from knittest.export.lock import run_name, slug
from knittest.export.summary import build_summary, ensemble_results
from knittest.laboratory.tensile.config import TensileRun

ROW = {
    "quantity": "peak_force_n", "simulated": 5820.0, "experiment_mean": 5800.0, "experiment_sd": 367.0,
    "deviation_sd": 0.054, "deviation_pct": 0.345, "kind": "tuned", "source": "Table 3",
}  # fmt: skip
RESULTS = {"peak_force_n": 5820.0, "fracture_strain_pct": 1.6, "force_per_yarn_n": 415.7}


@pytest.fixture
def run():
    """A run of a fabric whose details the export layer does not read."""
    from knittest.config.fabric import Fabric

    return TensileRun.model_construct(**{**Run.model_construct().__dict__, "fabric": Fabric.model_construct(name="2")})


def make(out: Path | None, run: Run) -> RunFolder:
    return RunFolder.create(out, run, config_text="rig: {kind: tensile}\n", threads=2)


def manifest(path):
    return json.loads((path / "manifest.json").read_text())


def test_manifest_is_first_and_running_then_completed(tmp_path, run):
    data = tmp_path / "pham2019" / "table3.csv"
    data.parent.mkdir()
    data.write_text("a\n1\n")
    with RunFolder.create(tmp_path / "r", run, config_text="x: 1\n", threads=2, data_files=[data]) as folder:
        first = manifest(folder.path)
        assert first["status"] == "running" and first["exit_code"] is None and first["ended"] is None
        assert (folder.path / "config.yaml").read_text() == "x: 1\n"
    last = manifest(tmp_path / "r")
    assert last["status"] == "completed" and last["exit_code"] == 0 and last["ended"] >= last["started"]
    assert last["config_sha256"] == hashlib.sha256(b"x: 1\n").hexdigest()
    assert list(last["data_sha256"]) == ["pham2019/table3.csv"]
    assert {"numpy", "numba", "python"} <= set(last["libraries"]) and last["threads"] == 2 and last["cpu"]
    assert not (tmp_path / "r" / lock.LOCK_NAME).exists()


@pytest.mark.parametrize(
    ("error", "status", "code"),
    [
        (NumericalError("NaN in beam 12 at 1.3 ms"), "failed", 3),
        (ResourceError("disk full"), "failed", 4),
        (OutOfTolerance("peak out of tolerance"), "completed", 5),
        (KeyboardInterrupt(), "interrupted", 75),
        (SystemExit(75), "interrupted", 75),
        (ValueError("a defect"), "failed", 1),
    ],
)
def test_how_a_run_ends(tmp_path, run, error, status, code):
    with pytest.raises(type(error)), make(tmp_path / "r", run) as folder:
        folder.write_table("curve.csv", curve(10.0))
        folder.write_json("summary.json", {"results": RESULTS})
        folder.write_json("comparison.json", {})
        raise error
    ended = manifest(tmp_path / "r")
    assert (ended["status"], ended["exit_code"]) == (status, code)
    kept = {file.name for file in (tmp_path / "r").iterdir()}
    if status == "completed":
        assert {"summary.json", "comparison.json", "curve.csv"} <= kept
    else:
        assert not {"summary.json", "comparison.json", "curve.csv"} & kept
        assert "curve.incomplete.csv" in kept
        assert isinstance(error, KeyboardInterrupt | SystemExit) or str(error) in ended["message"]


def test_tables_read_back_with_their_units(tmp_path, run):
    import pandas as pd

    columns = curve(5800.0)
    with make(tmp_path / "r", run) as folder:
        path = folder.write_table("curve.csv", columns)
        folder.write_table(
            "yarns.csv", {"yarn": [0, 1], "system": ["warp", "knit"], "fracture_strain_pct": [1.0, 2.69]}
        )
    table = pd.read_csv(path)
    assert list(table) == list(columns)
    np.testing.assert_allclose(table["force_n"], columns["force_n"], rtol=1e-9)
    assert (tmp_path / "r" / "yarns.csv").read_text().splitlines()[2] == "1,knit,2.69"


def test_log_is_one_object_a_line(tmp_path, run):
    with make(tmp_path / "r", run) as folder:
        folder.log("failure", element=np.int64(7), strain=np.float64("nan"))
    events = [json.loads(line) for line in (tmp_path / "r" / "log.jsonl").read_text().splitlines()]
    assert [event["event"] for event in events] == ["started", "failure"]
    assert events[1]["element"] == 7 and events[1]["strain"] is None


def test_default_folder_names(tmp_path, run, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("knittest.export.folder.run_name", lambda run: "tensile-2-meso-warp-20260101-120000")
    with make(None, run) as first, make(None, run) as second:
        assert first.path == Path("runs/tensile-2-meso-warp-20260101-120000")
        assert second.path.name == first.path.name + "-2"
    monkeypatch.undo()
    assert run_name(run, direction="both").startswith("tensile-2-meso-both-2")
    forming = resolve(variant="1", test="forming")
    assert run_name(forming).startswith("forming-pham2019-v1-macro-2")  # no direction, and no word for none


@pytest.mark.parametrize("text", ["../../etc/passwd", "<script>", "a b", "", "...", "ü" * 90])
def test_slug_is_a_plain_file_name(text):
    name = slug(text)
    assert name and not name.startswith((".", "-")) and not set(name) & set("/\\<>& ") and len(name) <= 60


def test_a_used_folder_is_refused(tmp_path, run):
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(InputError, match="not empty"):
        make(tmp_path, run)
    with pytest.raises(InputError, match="is a file"):
        make(tmp_path / "thesis.txt", run)
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.txt"]


def test_two_runs_cannot_share_a_folder(tmp_path, run):
    with make(tmp_path / "r", run):
        with pytest.raises(ResourceError, match=f"in use by process {os.getpid()} on "):
            make(tmp_path / "r", run)
        assert manifest(tmp_path / "r")["status"] == "running"


def test_a_lock_leaves_the_first_byte_to_windows_and_names_a_file_system_without_locks(tmp_path, monkeypatch):
    """Windows locks that byte, and lets nobody else read it; the owner stands behind it."""
    held = lock.RunLock(tmp_path)
    assert (tmp_path / lock.LOCK_NAME).read_bytes().startswith(b' {"pid": ')
    assert lock.is_locked(tmp_path)
    held.release()
    assert not lock.is_locked(tmp_path) and not (tmp_path / lock.LOCK_NAME).exists()
    monkeypatch.setattr(lock, "lock_descriptor", failing(errno.ENOLCK))
    with pytest.raises(ResourceError, match=r"run\.lock: cannot write: No locks available"):
        lock.RunLock(tmp_path)


def _killed_run(path: Path) -> int:
    """Leave ``path`` as a process does that is killed while it runs there; return its id."""
    script = f"""
        import os, signal
        from pathlib import Path
        from knittest.export.lock import RunLock
        path = Path({str(path)!r})
        path.mkdir()
        lock = RunLock(path)
        (path / "manifest.json").write_text('{{"status": "running"}}')
        (path / "frames").mkdir()
        (path / "frames" / "frame-0000.vtu").write_text("half")
        (path / ".curve.1.tmp.csv").write_text("half")
        os.kill(os.getpid(), signal.SIGKILL)
    """
    done = subprocess.Popen([sys.executable, "-c", textwrap.dedent(script)])
    assert done.wait(30) == -9
    return done.pid


def test_a_killed_runs_folder_is_taken_over_and_explained(tmp_path, run):
    dead = _killed_run(tmp_path / "r")
    with make(tmp_path / "r", run) as folder:
        assert f"process {dead} on" in folder.notice and "ended without completing" in folder.notice
    kept = {str(file.relative_to(tmp_path / "r")) for file in (tmp_path / "r").rglob("*") if file.is_file()}
    assert kept == {"manifest.json", "config.yaml", "log.jsonl"}


def test_a_killed_runs_folder_with_a_checkpoint_is_kept(tmp_path, run):
    _killed_run(tmp_path / "r")
    (tmp_path / "r" / "checkpoint-0001.npz").write_bytes(b"hours of work")
    with pytest.raises(InputError, match=r"checkpoint-0001\.npz"):
        make(tmp_path / "r", run)
    assert (tmp_path / "r" / "frames" / "frame-0000.vtu").exists()


def test_a_corrected_input_takes_the_folder_with_what_specimens_kept(tmp_path, run):
    """One specimen was finished and one under way when another was refused."""
    kept = ("checkpoint-specimen-0000.npz", "checkpoint-0001-0003.npz", ".checkpoint-0001-0004.7.tmp.npz")

    def end_with(error: Exception) -> None:
        with pytest.raises(type(error)), make(tmp_path / "r", run):
            for name in kept:
                (tmp_path / "r" / name).write_bytes(b"of another input")
            raise error

    end_with(InputError("specimen 3 of 3 (warp): its loops lock"))
    with make(tmp_path / "r", run):
        assert not any((tmp_path / "r" / name).exists() for name in kept)
        (tmp_path / "r" / kept[2]).write_bytes(b"of a process that died")
    assert not any((tmp_path / "r" / name).exists() for name in kept)
    shutil.rmtree(tmp_path / "r")
    end_with(NumericalError("specimen 3 of 3 (warp): node 7 flew off"))
    with pytest.raises(InputError, match="continue the run in it with: knittest resume"):
        make(tmp_path / "r", run)


def test_a_corrected_input_takes_the_folder_of_the_bad_one_and_nothing_else(tmp_path, run):
    def end_with(name: str, error: Exception) -> None:
        with pytest.raises(type(error)), make(tmp_path / name, run):
            raise error

    end_with("r", InputError("rig.width: too wide"))
    with make(tmp_path / "r", run):
        pass
    assert manifest(tmp_path / "r")["status"] == "completed"
    end_with("m", InputError("rig.width: too wide"))
    (tmp_path / "m" / "notes.txt").write_text("mine")
    end_with("n", NumericalError("not finite"))
    for name, words in (("r", "not empty"), ("m", r"notes\.txt"), ("n", "not empty")):
        with pytest.raises(InputError, match=words):
            make(tmp_path / name, run)


@pytest.mark.parametrize(
    ("code", "says"),
    [(errno.EROFS, "read-only"), (errno.EACCES, "no permission"), (errno.EDQUOT, "quota"), (errno.EIO, "Input/output")],
)
@pytest.mark.parametrize("out", ["r", None])
def test_a_place_one_cannot_write_to(tmp_path, run, monkeypatch, out, code, says):
    with pytest.raises(ResourceError, match="cannot write"):
        make(Path("/proc/knittest-run"), run)
    monkeypatch.setattr(Path, "mkdir", failing(code))
    with pytest.raises(ResourceError, match=says):
        make(out and tmp_path / out, run)


def failing(code: int = errno.ENOSPC) -> Callable[..., None]:
    """A call that the system refuses, by default because the disk is full."""

    def fail(*_: object, **__: object) -> None:
        raise OSError(code, os.strerror(code))

    return fail


WRITES = ("curve.csv", "energies.csv", "yarns.csv", "comparison.json", "summary.json")
CALLS = {"write": (Path, "write_bytes"), "fsync": (os, "fsync"), "replace": (Path, "replace")}


@pytest.mark.parametrize("call", CALLS)
@pytest.mark.parametrize("name", WRITES)
def test_full_disk_at_any_write_leaves_no_result(tmp_path, run, monkeypatch, name, call):
    def write(folder: RunFolder, file: str) -> None:
        (folder.write_json if file.endswith("json") else folder.write_table)(file, {"a": [1.0]})

    with pytest.raises(ResourceError, match="disk is full"), make(tmp_path / "r", run) as folder:
        for earlier in WRITES[: WRITES.index(name)]:
            write(folder, earlier)
        with monkeypatch.context() as broken:
            broken.setattr(*CALLS[call], failing())
            write(folder, name)
    ended = manifest(tmp_path / "r")
    assert ended["status"] == "failed" and ended["exit_code"] == 4 and "disk is full" in ended["message"]
    kept = {file.name for file in (tmp_path / "r").iterdir()}
    assert not kept & {*WRITES, lock.LOCK_NAME} and not [file for file in kept if ".tmp" in file]


@pytest.mark.parametrize("call", CALLS)
def test_full_disk_leaves_the_old_file(tmp_path, monkeypatch, call):
    path = tmp_path / "manifest.json"
    files.write_atomic(path, "old")
    with monkeypatch.context() as broken, pytest.raises(ResourceError):
        broken.setattr(*CALLS[call], failing())
        files.write_atomic(path, "new")
    assert path.read_text() == "old" and list(tmp_path.iterdir()) == [path]


def test_a_disk_that_stays_full_reports_the_first_error(tmp_path, run, monkeypatch):
    with pytest.raises(NumericalError, match="NaN"), make(tmp_path / "r", run):
        monkeypatch.setattr(Path, "write_bytes", failing())
        raise NumericalError("NaN in beam 12")
    assert manifest(tmp_path / "r")["status"] == "running"
    assert not (tmp_path / "r" / lock.LOCK_NAME).exists()


def test_summary_has_the_contracts_keys(tmp_path, run):
    summary = build_summary(run, [RESULTS], quality(), cost(), [ROW])
    with make(tmp_path / "r", run) as folder:
        written = json.loads(folder.write_json("summary.json", summary).read_text())
    top = "rig variant scale direction status results quality cost comparison kinds assumed refused warnings limits"
    gates = (
        "ke_over_ie_max energy_error_max damping_over_work_max contact_damping_over_work_max "
        "hourglass_over_internal_max penetration_over_radius_max overlap_at_start force_free_overlap_max "
        "added_mass_pct beyond_law drag_over_weight quasi_static"
    )
    costs = "wall_s cpu_s compile_s steps elements element_steps_per_s threads"
    assert [" ".join(keys) for keys in (written, written["quality"], written["cost"])] == [top, gates, costs]
    assert [written[key] for key in top.split()[:5]] == ["tensile", "2", "meso", "warp", "completed"]
    assert list(written["results"]) == list(RESULTS) and written["quality"]["quasi_static"] is True
    assert written["comparison"] == [ROW] and list(written["comparison"][0]) == list(ROW)


def test_state_of_rest_is_a_block_of_its_own(run):
    one, other = ({"thickness_mm": t, "normal_force_n.warp-weft": n} for t, n in ((2.0, 0.1), (3.0, 0.3)))
    alone = build_summary(run, [RESULTS], quality(), cost(), [ROW], rest=[one])
    assert alone["rest"] == {"thickness_mm": 2.0, "normal_force_n": {"warp-weft": 0.1}}
    both = build_summary(run, [RESULTS, RESULTS], quality(), cost(), [ROW], rest=[one, other])
    assert both["rest"]["thickness_mm"]["mean"] == 2.5
    assert "rest" not in build_summary(run, [RESULTS], quality(), cost(), [ROW], rest=[{}])


def test_a_failed_gate_refuses_the_comparison(run):
    summary = build_summary(run, [RESULTS], quality(("kinetic energy 9 % of the work",)), cost(), [ROW])
    assert summary["refused"] == ["kinetic energy 9 % of the work"]
    assert summary["comparison"] == [] and summary["quality"]["quasi_static"] is False


def test_a_result_that_one_specimen_lacks_has_no_mean():
    """Frames of which one has no wrinkles."""
    frames = [{"wrinkle_onset_deg": onset} for onset in (math.nan, 31.0)]
    found = ensemble_results(frames)["wrinkle_onset_deg"]
    assert math.isnan(found["mean"]) and math.isnan(found["sd"]) and found["values"][1] == 31.0


def test_json_has_no_nan(tmp_path, run):
    with make(tmp_path / "r", run) as folder:
        path = folder.write_json("summary.json", {"results": {"fracture_strain_pct": float("nan")}, "n": np.int64(3)})
    assert json.loads(path.read_text()) == {"results": {"fracture_strain_pct": None}, "n": 3}
