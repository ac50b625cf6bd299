"""Every command of README and docs does what it says: it ends with 0, or is planned to its first run."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from documented import ROOT, Do, Shown, shown
from documented_table import COMMANDS, NAMES, SETUP
from radioss_reader import history_text

import knittest.runs.bench
import knittest.runs.bench_comparison
import knittest.runs.preflight.command
import knittest.solve.compilation
import knittest.studies.command
import knittest.studies.trials.pool
from knittest.base.files import data_dir
from knittest.cli.main import run, summaries


class Planned(BaseException):
    """All is read, resolved and planned: the first run would begin."""


def _begins(*_: object, **__: object) -> None:
    raise Planned


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with what the pages take for granted: sweeps, a laboratory's files, curves, a finished run."""
    folder = tmp_path_factory.mktemp("documented")
    for name in ("sweeps", "calibrations", "uncertainty"):
        shutil.copytree(ROOT / "configs" / name, folder / "configs" / name)
    for path in (data_dir() / "tutorial").glob("*.csv"):
        shutil.copy(path, folder)
    (folder / "mine.csv").write_text("shear_angle_deg,normalised_shear_force_n_per_mm\n0,0\n5,0.005\n15,0.016\n")
    bias = "".join(f"{d},{0.4 * d**1.1:.4f}\n" for d in range(0, 41, 2))
    (folder / "bias-1.csv").write_text(f"Travel [mm],Force [N]\n{bias}")
    biaxial = "".join(f"{0.05 * k:.2f},{300.0 * k:g}\n" for k in range(31))
    (folder / "biaxial-1.csv").write_text(f"Strain [%],Force [N]\n{biaxial}")
    pulls = "".join(f"{0.02 * k:.2f},{max(0.02 * k - 0.2, 0.0):.2f},{min(0.1 * k, 1.0) * 0.3:g}\n" for k in range(500))
    (folder / "pulls-1.csv").write_text(f"travel [mm],free end [mm],force [N]\n{pulls}")
    cycled = "".join(f"{10.0 - abs(10.0 - 0.5 * k):g},{0.1 * (10.0 - abs(10.0 - 0.5 * k)):g}\n" for k in range(41))
    (folder / "cycled-1.csv").write_text(f"shear angle [deg],force [N]\n{cycled}")
    (example,) = re.findall(
        r"^```\n((?:# .*\n)*strain_pct.*?)^```$", (ROOT / "docs/tensile.md").read_text(), re.M | re.S
    )
    (folder / "example.csv").write_text(example)
    (steps,) = re.findall(r"^```\n(fraction,.*?)^```$", (ROOT / "docs/cell.md").read_text(), re.M | re.S)
    (folder / "steps.csv").write_text(steps)
    time, pulled = np.linspace(0.0, 4.0, 41), np.zeros((41, 1, 4))
    pulled[:, 0, 1], pulled[:, 0, 3] = 0.8 * time, 700.0 * time**2  # displacement [mm] and impulse [N ms] along y
    (folder / "deck").mkdir()
    (folder / "deck/tensile-warpT01").write_text(history_text(time, [(0, [1, 2, 620, 621], [1], pulled)]))
    (folder / "mean.csv").write_text("strain_pct,force_n\n0,0\n0.8,2100\n1.6,5800\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        shells = "tensile --variant 1 --scale macro --preset quick --no-frames --quiet --out runs/shells"
        assert run(shells.split()) == 0
    return folder


@pytest.mark.parametrize(("text", "do"), COMMANDS.items(), ids=list(COMMANDS))
def test_documented_command(place, monkeypatch, text: str, do: Do):
    """In the order of the table: some take what one before them has left."""
    monkeypatch.chdir(place)
    number = list(COMMANDS).index(text)
    words = [word.replace("{out}", f"runs/documented-{number}") for word in do.words(text)]
    arguments = [found for word in words[1:] for found in _files(word)]
    if not do.planned:
        assert run(arguments) == 0, " ".join(words)
        if "--against" in arguments and "--out" in arguments:
            found = json.loads(Path(arguments[arguments.index("--out") + 1], "comparison.json").read_text())
            assert len(found["curves"]) >= arguments.count("--against")
        return
    for pool in (knittest.studies.trials.pool.LocalPool, knittest.studies.trials.pool.DaskPool):
        monkeypatch.setattr(pool, "__init__", _begins)
    for module, name in (
        (knittest.studies.command, "execute"), (knittest.runs.preflight.command, "prepare"),
        (knittest.runs.bench, "kernel_lines"), (knittest.solve.compilation, "load_kernels"),
        (knittest.runs.bench_comparison, "paired_lines"),
    ):  # fmt: skip
        monkeypatch.setattr(module, name, _begins)
    with pytest.raises(Planned):
        run(arguments)


def _files(word: str) -> list[str]:
    """Expansion of ``word`` by a shell."""
    return sorted(map(str, Path().glob(word))) if "*" in word else [word]


def test_the_tables_hold_the_commands_of_the_pages_and_no_others():
    """A new one goes into a table of documented_table.py, with what makes it small, or why it is only planned."""
    known, texts = (*COMMANDS, *NAMES, *SETUP), {one.text for one in shown()}
    assert [f"{one.page}: {one.text}" for one in shown() if one.text not in known] == []
    assert [text for text in known if text not in texts] == []
    assert all(do.planned == "" or len(do.planned) > 5 for do in COMMANDS.values())


@pytest.mark.parametrize("text", NAMES)
def test_a_command_that_is_only_named_is_there(text):
    assert text.split()[1] in summaries()


def test_commands_are_found_in_blocks_and_lines(tmp_path, monkeypatch):
    import documented

    page = tmp_path / "page.md"
    page.write_text(
        "Take `knittest doctor` first.\n\n```\nknittest tensile --variant 1 \\\n    --scale macro   # shells\n```\n\n"
        "1. Then\n\n  ```sh\n  knittest new a && knittest check\n  ```\n```yaml\nknittest: no command\n```\n"
    )
    monkeypatch.setattr(documented, "PAGES", (page,))
    assert [(one.text, one.inline) for one in documented.shown()] == [
        ("knittest tensile --variant 1 --scale macro", False), ("knittest new a", False), ("knittest check", False),
        ("knittest doctor", True),
    ]  # fmt: skip
    assert isinstance(documented.shown()[0], Shown)
