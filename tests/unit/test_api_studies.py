"""Studies as functions: what reaches the command's own code, and what a folder is read as."""

from pathlib import Path

import pytest

import knittest
from knittest.errors import InputError, RefusedWarning
from knittest.studies.trials.runner import StudyResult

RUNS = {
    "batch": "knittest.studies.batch.command.run_batch",
    "calibrate": "knittest.studies.calibrate.command.run_calibration",
    "uncertainty": "knittest.studies.uncertainty.command.run_uncertainty",
    "homogenise": "knittest.studies.homogenise.command.run_homogenisation",
}


@pytest.fixture
def called(monkeypatch, tmp_path):
    """Calls a study that would have run and ends with ``code``; returns the study and what reached its command."""

    def call(name, *args, code=0, **given):
        found = []
        monkeypatch.setattr(RUNS[name], lambda *handed: found.extend(handed) or StudyResult(tmp_path, code))
        return getattr(knittest, name)(*args, **given), found

    return call


@pytest.mark.parametrize("name", ["batch", "calibrate", "uncertainty"])
def test_options_are_those_of_the_command(called, name, tmp_path):
    study, (path, options, *_) = called(name, "file.yaml", out="there", workers=3, quiet=True, accept_limits=True)
    assert path == Path("file.yaml") and options.out == Path("there")
    assert (options.workers, options.quiet, options.accept_limits) == (3, True, True)
    assert study.passed and study.folder == tmp_path


def test_a_card_is_of_the_fabric_and_the_numbers_that_were_given(called):
    fabric = knittest.Fabric.load("2").with_(loop_length=14.2)
    _, (request, options, command) = called("homogenise", fabric, source="cell", set={"solver.speed": 0.3}, quiet=True)
    assert (request.variant, request.source, request.preset, options.quiet) == ("2", "cell", "quick", True)
    assert request.sets == ("fabric.loop_length=14.2", "solver.speed=0.3") and "fabric.loop_length=14.2" in command


@pytest.mark.parametrize(("name", "code"), [("batch", 3), ("calibrate", 3), ("uncertainty", 3), ("homogenise", 5)])
def test_what_did_not_pass_warns_where_it_was_called(called, name, code):
    with pytest.warns(RefusedWarning) as warned:
        study, _ = called(name, "1" if name == "homogenise" else "f.yaml", code=code)
    assert not study.passed and Path(warned[0].filename) == Path(__file__)


def test_a_folder_is_read_when_asked_and_says_what_it_lacks(tmp_path):
    study = knittest.Study(tmp_path)
    assert study.summary == {}
    for name in ("results", "fabric", "page"):
        with pytest.raises(InputError, match="has no"):
            getattr(study, name)
    (tmp_path / "results.csv").write_text("status,peak_force_n\ncompleted,3.5\n")
    (tmp_path / "calibration.json").write_text('{"converged": true}')
    (tmp_path / "fabric.yaml").write_text("name: mine\n")
    assert study.results["peak_force_n"].tolist() == [3.5] and study.summary == {"converged": True}
    assert study.fabric.file == tmp_path / "fabric.yaml"


def test_a_bad_file_is_the_error_of_the_command(tmp_path):
    (tmp_path / "s.yaml").write_text("base: {variant: 1}\ngrid: {rig.widht: [1]}\n")
    with pytest.raises(InputError, match="widht"):
        knittest.batch(tmp_path / "s.yaml", out=tmp_path / "out")
    assert not (tmp_path / "out").exists()
