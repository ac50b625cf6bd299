"""At 80 columns no line of a table, note or comparison is longer, and nothing is cut."""

import io
import json
import re
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from report_sample import edit_json, write_run

from knittest.base import layout
from knittest.base.files import data_dir
from knittest.base.layout import shorten_path, table, wrap_line
from knittest.base.result_rows import LABELS, UNRESOLVED
from knittest.cli.main import cli
from knittest.config.loading import resolve
from knittest.runs.preflight.measured_counterparts import Counterpart, table_cells
from knittest.runs.terminal_output import _NUMBERS, HEADER, curve_line, print_results
from knittest.studies.verify import read_outcome

WIDTH = 80
WHY = "20 mm: refused: " + "why " * 30


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def plain(text: str) -> str:
    return re.sub(r"\x1b\[[0-9;]*m", "", text)


def fits(text: str, *whole: str) -> None:
    """Every line of ``text`` is short enough and ends where it should; ``whole`` can be read across the line ends."""
    assert max(map(len, text.splitlines())) <= WIDTH, max(text.splitlines(), key=len)
    assert "…" not in text and "..." not in text
    words = " ".join(text.split())
    assert all(one in words for one in whole), [one for one in whole if one not in words]


def column(lines: list[list[str]], head: str, row: int, name: str, after: str | None) -> str:
    """Text of the cell of ``row`` below the head ``name``, put together from its lines."""
    start = lines[0][0].index(name)
    end = None if after is None else lines[0][0].index(after)
    return "".join(line[start:end].strip() for line in lines[row])


@pytest.mark.parametrize("name", ["picture-frame", "friction", "cantilever", "weft"])
@pytest.mark.parametrize("quantity", list(LABELS))
def test_the_widest_row_of_any_result_fits_with_all_its_words(name: str, quantity: str) -> None:
    row = (
        name, LABELS[quantity][0], "6000 ± 500 (n 8), numerical ± 160", "12000 ± 461 (scaled from 100 to 50 mm)",
        "+2.55 ± 0.98 sd", "predicted, on 2 assumed inputs", f"{UNRESOLVED}, numerical error unknown",
    )  # fmt: skip
    told = table([HEADER, row], WIDTH, _NUMBERS)
    assert max(len(line) for lines in told for line in lines) <= WIDTH
    words = sorted(" ".join(row).split())
    joined = "".join(sorted("".join(" ".join(told[1]).split())))
    assert joined == "".join(sorted("".join(words)))


def test_a_table_that_fits_is_left_alone_and_a_pipe_has_no_width(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [("a", "number"), ("long words here", "5")]
    assert table(rows, right=(1,)) == [["a                number"], ["long words here       5"]]
    assert table(rows, WIDTH, (1,)) == table(rows, right=(1,))
    assert table(rows, 14, (1,)) == [["a       number"], ["long         5", "words", "here"]]
    assert table([("p",), ("data/mine/warp/tension.csv",)], 12) == [["p"], ["data/mine/", "warp/", "tension.csv"]]
    monkeypatch.delenv("COLUMNS", raising=False)
    assert layout.width_of(io.StringIO()) is None
    monkeypatch.setenv("COLUMNS", "80")
    assert layout.width_of(io.StringIO()) == layout.width_of(Terminal()) == 80


def test_lines_wrap_indented_and_keep_long_words() -> None:
    line = "  warning: " + "word " * 20 + "/a/path/that/is/longer/than/forty/columns/of/a/terminal end"
    told = wrap_line(line, 40)
    assert told[0].startswith("  warning: word") and all(part.startswith("    ") for part in told[1:])
    assert " ".join(" ".join(told).split()) == " ".join(line.split())
    assert [part for part in told if len(part) > 40] == ["    /a/path/that/is/longer/than/forty/columns/of/a/terminal"]
    assert wrap_line(line, None) == [line]


def test_paths_are_shown_from_here_where_that_is_shorter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert shorten_path(tmp_path / "runs/a") == "runs/a"
    assert shorten_path("/x") == "/x" and shorten_path("runs/a") == "runs/a"


@pytest.mark.parametrize("stream", [Terminal, io.StringIO])
def test_a_verified_run_fits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stream: Any) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    kinds = {"tensile": "warp", "picture-frame": "", "cantilever": "warp", "friction": "warp"}
    for kind in kinds:
        folder = write_run(tmp_path / f"runs/{kind}-with-a-long-name", kind, sets=["output.verify=true"])
        results = json.loads((folder / "summary.json").read_text())["results"]
        flat = {f"{k}.{a}": v for k, inner in results.items() if isinstance(inner, dict) for a, v in inner.items()}
        flat |= {k: v for k, v in results.items() if not isinstance(v, dict)}
        errors = {
            k: {"half_speed_pct": 1.0, "coarser_mesh_pct": 1.0, "error": abs(0.03 * (v or 0))} for k, v in flat.items()
        }
        repeat = {"setting": "model.macro.element_size", "value": "6.25 mm", "other_value": "12.5 mm"}
        repeat |= {"status": "completed", "wall_s": 12.3, "cpu_s": 45.6}
        edit_json(
            folder / "summary.json", numerical_error=errors,
            verification={"specimen": 1, "half_speed": repeat, "mesh": repeat | {"instead_of": WHY}},
            warnings=["a warning that is long enough to be wrapped: " + "it goes on " * 8],
        )  # fmt: skip
        out = stream()
        print_results([read_outcome(resolve(config=folder / "config.yaml"), folder)], out)
        text = plain(out.getvalue())
        fits(text, f"runs/{kind}-with-a-long-name", "in place of 20 mm: refused: why why", "it goes on it goes on")
        assert str(tmp_path) not in text
        if stream is Terminal and kind == "tensile":
            assert "\x1b[" in out.getvalue()


def test_check_fits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    path = tmp_path / "a/folder/with/a/rather/long/name/warp-of-mine.csv"
    path.parent.mkdir(parents=True)
    path.write_text((data_dir() / "pham2019/curves/tensile-v1-warp.csv").read_text())
    monkeypatch.chdir(path.parent)
    sets = [f"fabric.macro.tension={{warp: {path}, weft: pham2019/curves/tensile-v1-weft.csv}}"]
    arguments = ["check", "tensile", "--variant", "1", "--scale", "macro", "--preset", "quick", "--no-time"]
    result = CliRunner().invoke(cli, [*arguments, *(word for text in sets for word in ("--set", text))])
    assert result.exit_code == 0, result.output
    fits(result.stdout, "yarns across 14, width 50 mm, gauge 200 mm, area 11000 mm2", "25 agree, 2 differ")
    assert "warp-of-mine.csv" in result.stdout and str(tmp_path) not in result.stdout
    rows = table_cells(
        [Counterpart("a", "b", "mm", 1.0, "assumed", None, "no row, for a reason that is told at length")]
    )
    assert max(len(line) for lines in table(rows, WIDTH, indent="  ") for line in lines) <= WIDTH


def test_compare_and_stats_fit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", str(WIDTH))
    monkeypatch.chdir(tmp_path)
    folder = write_run(tmp_path / "r")
    command = ["compare", str(folder), "--against", "pham2019/curves/tensile-v1-warp.csv"]
    for more in ([], ["--json"]):
        result = CliRunner().invoke(cli, [*command, *more])
        assert result.exit_code == 0
        told = result.stderr if more else result.stdout
        fits(told, "no rating: the reference is an input of the model, which only returns it")
    assert "no rating" in curve_line(json.loads(result.stdout))
    tests = {"tensile": ["warp-1.csv", "warp-2.csv"], "picture-frame": ["frame-1.csv", "frame-2.csv", "frame-3.csv"],
             "cantilever": ["cantilever-warp.csv"], "friction": ["friction-1.csv", "friction-2.csv"]}  # fmt: skip
    for test, names in tests.items():
        files = [str(data_dir() / "tutorial" / name) for name in names]
        more = ["--area-mass", "830", "--width", "50"] if test == "cantilever" else []
        result = CliRunner().invoke(cli, ["data", "stats", *files, "--test", test, *more])
        assert result.exit_code == 0, result.output
        fits(result.stdout, "mean", "sd")
