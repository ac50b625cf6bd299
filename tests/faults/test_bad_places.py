"""Names, places and settings of the machine that no file or library takes: one line that says so, no internal error."""

import os
import subprocess
import sys

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.cli.main import run
from knittest.config.laws import YarnLaw
from knittest.config.loading import resolve
from knittest.laboratory.cantilever.macro_strip import mount_shells
from knittest.materials.yarn_section import section
from knittest.solve.threads import check_layer

SHELLS = ["tensile", "--variant", "1", "--scale", "macro", "--direction", "warp", "--quiet"]
PLACES = {"long": "x" * 300, "deep": "x/" * 5000 + "x", "nested": "x/" * 1500 + "x", "within": "y/" + "x" * 300 + "/z"}


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def one_line(capsys) -> str:
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "internal" not in error and len(error) < 500, error
    return error


@pytest.mark.parametrize("place", list(PLACES))
@pytest.mark.parametrize("direction", ["warp", "both"])
def test_a_folder_that_no_file_system_takes(place, direction, tmp_path, capsys):
    assert run([*SHELLS, "--direction", direction, "--out", PLACES[place]]) == 2
    assert "expected at most" in one_line(capsys)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["batch", "calibrate"])
def test_a_study_in_such_a_folder(command, tmp_path, capsys):
    assert run([command, "missing.yaml", "--out", "x" * 300]) == 2
    assert run(["resume", "x" * 300]) == 2
    assert run(["report", "x" * 300]) == 2
    assert run(["tensile", "--fabric", "x" * 5000]) == 2
    assert "internal" not in capsys.readouterr().err


def test_a_threading_layer_that_there_is_not(monkeypatch, capsys):
    def unknown():
        raise ValueError("The threading layer requested 'nonsense' is unknown to Numba.")

    monkeypatch.setattr("knittest.kernels.threading.threading_layer", unknown)
    check_layer()  # nobody asked for one
    monkeypatch.setenv("NUMBA_THREADING_LAYER", "nonsense")
    assert run([*SHELLS, "--out", "run"]) == 2
    assert "NUMBA_THREADING_LAYER=nonsense" in one_line(capsys)


def test_a_yarn_that_carries_nothing_or_more_than_a_number_holds():
    yarn = resolve(variant="1", scale="meso", direction="warp").fabric.reinforcing
    for points in ([[0, 0], [1, 0], [2, 0]], [[0, 0], [1e-300, 1e300]]):
        law = YarnLaw.model_construct(kind="table", points=points)
        with pytest.raises(InputError, match="largest tangent modulus is"):
            section(yarn.model_copy(update={"law": law}), 1.0)


@pytest.mark.parametrize("command", [["schema"], ["--help"], ["batch", "--help"]])
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_what_cannot_be_printed_is_an_error(command, unbuffered):
    """A full disk behind ``>``: the code says that the output is not there, also where it is only met at the end."""
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run(
            [sys.executable, "-m", "knittest.cli.main", *command], stdout=full, stderr=subprocess.PIPE, text=True,
            env=os.environ | {"PYTHONUNBUFFERED": unbuffered},
        )  # fmt: skip
    assert done.returncode == 4, done
    assert "standard output cannot be written: No space left" in done.stderr and "Traceback" not in done.stderr


@pytest.mark.parametrize("overhang", [5.0, 40.0])
def test_a_short_strip_bends_as_it_does(overhang):
    """A parabola, w = k s^2 / 2 with k = 1e-3 / mm, on shells of 5 mm: read to rounding, nothing is divided by zero."""
    chosen = resolve(test="cantilever", variant="1", scale="macro", direction="warp", sets=[f"rig.overhang={overhang}"])
    mounting = mount_shells(chosen, overhang).mount
    down = 0.5e-3 * np.maximum(mounting.flat[:, 1], 0.0) ** 2
    assert mounting.curvature(mounting.flat - np.outer(down, [0.0, 0.0, 1.0])) == pytest.approx(1e-3, rel=1e-9)


@pytest.mark.parametrize("command", ["tensile --variant 7", "tensile --nonsense", "resume none"])
def test_the_code_stands_where_no_error_can_be_written(command):
    with open("/dev/full", "w") as full:  # noqa: PTH123
        done = subprocess.run([sys.executable, "-m", "knittest.cli.main", *command.split()], stderr=full, stdout=full)
    assert done.returncode == 2
