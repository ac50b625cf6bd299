"""Progress on a terminal, in a pipe and quiet; the table of results."""

import io
import json
import math
import re
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from export_sample import quality

from knittest.base.history import Quality
from knittest.base.layout import table
from knittest.base.progress import Progress, Status, duration, fit_line
from knittest.base.result_rows import _number_text
from knittest.config.loading import resolve
from knittest.config.quality_checks import quality_checks_of
from knittest.config.run import Run
from knittest.laboratory.quality_checks import evaluate_check
from knittest.laboratory.report_base import TESTS
from knittest.runs.specimen import Watcher
from knittest.runs.terminal_output import (
    HEADER,
    print_json,
    print_rejected,
    print_results,
    quality_lines,
    results_table,
)

COMPILING = "compiling kernels (once, about 20 s)"
NOT_COMPARED = "not compared with the experiment"


class Clock:
    """A clock that the test moves."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


class Terminal(io.StringIO):
    """A stream that says it is a terminal."""

    def isatty(self) -> bool:
        return True


class Broken(io.StringIO):
    """A pipe whose reader has gone."""

    def write(self, text: str) -> int:
        raise BrokenPipeError(32, "Broken pipe")


STREAMS = pytest.mark.parametrize("kind", [io.StringIO, Terminal])


def plain(stream: io.StringIO) -> str:
    """Text on a terminal without its control sequences."""
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", stream.getvalue())


def drive(stream: io.StringIO, until_failure: bool = True, **options: Any) -> None:
    """A compilation of 18 s and a simulation of 20 s, reported each 0.25 s."""
    clock = Clock()
    with Progress(stream=stream, clock=clock, **options) as progress:
        progress.phase(COMPILING)
        clock.now += 18.0
        progress.phase("warp: simulating", until_failure=until_failure)
        for step in range(81):
            progress.update(step / 80, 0.05 * step, 0.112, 0.003)
            clock.now += 0.25


@pytest.mark.parametrize("width", [60, 72, 80, 100, 132])
@pytest.mark.parametrize("text", ["warp: running tensile warp", "picture-frame: running picture-frame", "x" * 70])
@pytest.mark.parametrize("until_failure", [False, True])
def test_bar_percents_and_time_left_stay_in_a_line_of_the_terminal(width, text, until_failure) -> None:
    status = Status(0.25, 1234.567, 0.112, 0.003, 4000.0, until_failure)
    named, bar, told = fit_line(text, status, width)
    assert len(named) + 1 + bar + 1 + len(" 25 %") + 1 + len(told) <= width
    assert bar >= 10 and told.startswith("ETA 1:06:40") and named[:10] == text[:10]
    assert len(named) == len(text) or bar == 10  # a name is cut last
    assert fit_line("warp", status, 132) == ("warp", 30, status.text())  # a wide one shows everything


@pytest.mark.parametrize("columns", [60, 80])
def test_the_drawn_line_is_whole_at_80_columns(columns, monkeypatch) -> None:
    """As rich draws it: the percents and the time left are there, and nothing was cut."""
    monkeypatch.setenv("COLUMNS", str(columns))
    stream = Terminal()
    drive(stream)
    drawn = [line for line in re.split(r"[\r\n]", plain(stream)) if "%" in line]
    assert len(drawn) > 20
    going = [line for line in drawn if "100 %" not in line]
    assert all("ETA" in line and "━" in line and "…" not in line for line in going)
    assert max(map(len, (line.rstrip() for line in drawn))) <= columns


def test_a_pipe_gets_plain_lines_every_few_seconds() -> None:
    stream = io.StringIO()
    drive(stream)
    lines = stream.getvalue().splitlines()
    assert lines[0] == COMPILING and lines[1] == f"{COMPILING}: done in 18.0 s" and lines[2] == "warp: simulating"
    shown = [line for line in lines if "step 0.112 us" in line]
    assert [line[:6] for line in shown] == ["  25 %", "  50 %", "  75 %", " 100 %"]  # at 5, 10, 15 and 20 s
    assert shown[1] == "  50 %  ETA 0:10 or until failure  time 2.000 ms  step 0.112 us  kinetic/work 0.3 %"
    assert shown[3] == " 100 %  time 4.000 ms  step 0.112 us"  # what is broken flies apart
    assert lines[-1] == "warp: simulating: done in 20.2 s" and "\x1b" not in stream.getvalue()
    drive(unfailing := io.StringIO(), until_failure=False)
    assert "  50 %  ETA 0:10  time 2.000 ms" in unfailing.getvalue()
    assert [kind for kind, test in TESTS.items() if test.ends_at_failure] == ["tensile", "biaxial"]


@STREAMS
def test_a_test_that_ends_at_failure_ends_at_100_percent(kind, monkeypatch) -> None:
    monkeypatch.setenv("COLUMNS", "140")
    stream, clock = kind(), Clock()
    with Progress(stream=stream, clock=clock) as progress:
        for direction in ("warp", "weft"):
            progress.phase(f"{direction}: simulating")
            for step in range(53):
                progress.update(step / 100, 0.05 * step, 0.112, 0.003)
                clock.now += 0.25
            progress.phase("writing")
    text = stream.getvalue()
    whole = text.index("100 %")
    assert text.index(" 40 %") < whole < text.index("warp: simulating: done") and text.count("100 %") >= 2
    assert "-:--" not in text or kind is Terminal  # a line is not worth it before the time is known


def test_a_terminal_gets_a_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "140")
    stream = Terminal()
    drive(stream)
    assert f"{COMPILING}: done in 18.0 s" in plain(stream)
    shown = r"ETA 0:10 or until failure +time 2\.000 ms +step 0\.112 us +kinetic/work 0\.3 %"
    assert re.search(rf"warp: simulating .* 50 % +{shown}", plain(stream))
    assert "\x1b[2K" in stream.getvalue()  # redrawn in place
    assert stream.getvalue().count("\x1b[?25h") == stream.getvalue().count("\x1b[?25l")


@STREAMS
def test_quiet_prints_nothing_and_an_interrupted_phase_is_not_done(kind) -> None:
    stream = kind()
    drive(stream, quiet=True)
    assert stream.getvalue() == ""
    with pytest.raises(KeyboardInterrupt), Progress(stream=stream) as progress:
        progress.phase("warp: simulating")
        progress.update(0.1, 0.1, 0.1, 0.1)
        raise KeyboardInterrupt
    assert "done" not in stream.getvalue()
    assert stream.getvalue().count("\x1b[?25l") == stream.getvalue().count("\x1b[?25h")  # the cursor is back


def test_a_broken_or_closed_stream_does_not_stop_the_run() -> None:
    drive(Broken())
    stream = io.StringIO()
    with Progress(stream=stream) as progress:
        stream.close()
        progress.phase("x")
        progress.update(0.5, 1.0, 0.1, 0.0)


@pytest.mark.parametrize(
    ("seconds", "text"), [(6.6, "0:07"), (59.7, "1:00"), (750, "12:30"), (7380, "2:03:00"), (math.nan, "-:--")]
)
def test_duration(seconds: float, text: str) -> None:
    assert duration(seconds) == text


@STREAMS
def test_parallel_runs_and_resumed_ones_report_themselves(kind) -> None:
    stream, clock = kind(), Clock()
    with Progress(stream=stream, clock=clock) as progress:
        progress.phase("weft: running in parallel")
        store: Any = SimpleNamespace(interval=1.0)
        Watcher(store, 0, "warp", True, progress, print).report_resume(0.637, 5.2)
        clock.now += 3.0
        progress.report_done("weft, beside", 75.31)
    assert "weft, beside: done in 75.3 s" in stream.getvalue() and "running in parallel: done" not in stream.getvalue()
    assert "warp: resumed at 5.2 ms, 64 % of the test" in stream.getvalue()


@STREAMS
def test_an_attempt_that_restarts_is_not_done(kind) -> None:
    stream, clock = kind(), Clock()
    store: Any = SimpleNamespace(interval=1.0, drop=lambda specimen: None)
    with Progress(stream=stream, clock=clock, interval=0.0) as progress:
        watcher = Watcher(store, 0, "warp", False, progress, lambda *_, **__: None)
        watcher.phase("running")
        watcher.progress(0.4, 1.0, 0.1, 0.2)
        watcher.restarts(0.5, "kinetic energy 9 % exceeds the limit; restart at 1 m/s")
        watcher.phase("running")
        clock.now += 7.0
    said = plain(stream)
    assert "warp: kinetic energy 9 % exceeds the limit; restart at 1 m/s" in said and "100 %" not in said
    assert said.count("done") == 1 and "warp, attempt 2: running: done in 7.0 s" in said


@dataclass(frozen=True)
class Done:
    """A finished run as the table takes it."""

    summary: dict[str, Any]
    quality: Quality
    folder: Path = Path("runs/tensile-2-meso-both-20260101-120000/weft")
    curves: tuple[dict[str, Any], ...] = ()
    run: Run = field(default_factory=lambda: resolve(variant="2", scale="meso"))


def row(quantity: str, simulated: float, mean: float, sd: float, kind: str = "predicted") -> dict[str, Any]:
    return {
        "quantity": quantity, "simulated": simulated, "experiment_mean": mean, "experiment_sd": sd,
        "deviation_sd": (simulated - mean) / sd, "kind": kind, "source": "Table 3",
    }  # fmt: skip


def weft(gates: Quality | None = None, **changes: Any) -> Done:
    comparison = [row("peak_force_n", 8300.0, 7332.0, 380.0), row("fracture_strain_pct", 1.6, 1.6, 0.2, "tuned")]
    results = {"peak_force_n": 8300.0, "fracture_strain_pct": 1.6, "force_per_yarn_n": 415.0}
    summary = {"direction": "weft", "results": results, "comparison": comparison} | changes
    return Done(summary, gates or quality())


def printed(*runs: Done, stream: io.StringIO | None = None, details: bool = True) -> str:
    stream = stream or io.StringIO()
    print_results(runs, stream, details)
    return stream.getvalue()


def test_table_rows() -> None:
    assert results_table([weft()]) == [
        ("weft", "peak force [N]", "8300", "7332 ± 380", "+2.55 sd", "predicted", "outside 1 sd"),
        ("weft", "fracture strain [%]", "1.60", "1.60 ± 0.20", "+0.00 sd", "tuned", "within 1 sd"),
    ]
    spread = {"mean": 7345.6, "sd": 401.2, "values": [7000.0, 7345.6, 7700.0]}
    ensemble = results_table([weft(results={"peak_force_n": spread})], plus_minus="+-")
    assert [line[2] for line in ensemble] == ["7346 +- 401 (n 3)"]
    assert {line[-1] for line in results_table([weft(comparison=[])])} == {"no reference"}
    unscattered = row("peak_force_n", 8300.0, 7332.0, 380.0) | {"experiment_sd": None, "deviation_sd": None}
    assert results_table([weft(comparison=[unscattered])])[0][3:] == ("7332", "+13.2 %", "predicted", "sd not stated")


def test_the_relaxed_fabric_is_one_line_under_the_table() -> None:
    rest = {"loop_tension_n": 0.2, "normal_force_n": {"warp-weft": 0.4}, "thickness_mm": 2.2, "out_of_balance_pct": 0.5}
    lines = printed(weft(rest=rest), weft()).splitlines()
    (line,) = [line for line in lines if line.startswith("relaxed fabric, weft: ")]
    assert "0.2 N" in line and "2.20 mm" in line and len(line) <= 80


def test_the_brief_output_has_checks_few_warnings_folder_and_no_more() -> None:
    """Also no warning of a check that passed near its limit, in the words of the laboratory."""
    run = resolve(variant="2", scale="macro")
    gate = next(one for one in quality_checks_of(run) if one.key == "ke_over_ie_max")
    near = evaluate_check(run, Quality(0.04, 0.0, 0.0, 0.0, 0.0, True, ()), gate).warnings
    assert len(near) == 1
    gates = Quality(0.0, 0.0, 0.0, 0.0, 0.0, True, (), (*near, "a", "b", "c", "d"))
    table, _, below = printed(weft(gates), weft(gates), details=False).partition("\n\n")
    assert len(table.splitlines()) == 5
    assert below.splitlines() == [
        "quality checks: passed; --details shows their numbers, assumptions and notes", "warning: a", "warning: b",
        "warning: c", "1 more warning in the report, or with --details", f"run folder: {weft().folder.parent}",
    ]  # fmt: skip


def test_a_run_that_fails_checks_is_not_compared_and_every_output_has_the_reasons() -> None:
    failed = weft(quality(("kinetic energy 9 %", "added mass 6 %")))
    assert printed(failed, details=False).partition("\n\n")[2].splitlines()[:3] == [
        f"quality checks, weft: FAILED, {NOT_COMPARED}", "  kinetic energy 9 %", "  added mass 6 %",
    ]  # fmt: skip
    rows, stream = results_table([failed]), io.StringIO()
    assert len(rows) == 2 and {line[3:6] for line in rows} == {("-", "-", "-")}
    lines = quality_lines(failed)
    assert f"FAILED, {NOT_COMPARED}" in lines[0] and lines[1] == "  failed: kinetic energy 9 %"
    print_rejected([weft(), failed], stream)
    reasons = f"{NOT_COMPARED}: kinetic energy 9 %; added mass 6 %"
    assert stream.getvalue() == f"knittest: {weft().folder}: {reasons}\n"


def test_columns_that_would_be_empty_are_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm-256color")
    heads = {io.StringIO: (["direction"], ["weft"]), Terminal: ([], [])}
    for kind, (head, name) in heads.items():
        text = printed(weft(comparison=[]), stream=kind())
        shown = [line.split() for line in text.splitlines()[:2]]
        assert shown == [[*head, "quantity", "simulated"], [*name, "peak", "force", "[N]", "8300"]]
        assert "\nno reference: " in text
    text = printed(weft(quality(("kinetic energy 9 %",))))
    assert text.splitlines()[0].split() == ["direction", "quantity", "simulated", "verdict"]


def test_checks_in_one_line_without_what_a_shell_has_not() -> None:
    gates = Quality(0.008, 0.0012, math.nan, math.nan, 0.0, True, (), ("kinetic energy 3 %",))
    numbers = "kinetic energy/work 0.8 %, energy error 0.12 %, damping/work 0 %, added mass 0 %"
    assert quality_lines(weft(gates)) == [f"quality checks, weft: passed ({numbers})", "  warning: kinetic energy 3 %"]


def test_a_relaxed_limit_has_not_failed() -> None:
    loose = "solver.max_kinetic_ratio = 50 %, looser than the preset's 5 %: leave it"
    for reasons, verdict in (((loose,), "passed with relaxed limits"), ((loose, "kinetic energy 60 %"), "FAILED")):
        assert quality_lines(weft(quality(reasons)))[0].startswith(f"quality checks, weft: {verdict}, {NOT_COMPARED} (")


@pytest.mark.parametrize(("ratio", "shown"), [(1e7, "-"), (math.nan, "-"), (1.01, "-"), (0.99, "99 %"), (0.0, "0 %")])
def test_kinetic_energy_before_the_first_work_is_no_ratio(ratio: float, shown: str) -> None:
    assert Status(0.5, 2.0, 0.1, ratio, 10.0).text().endswith(f"kinetic/work {shown}")


def test_a_pipe_gets_an_aligned_table() -> None:
    text = printed(weft())
    lines = text.splitlines()
    columns = [lines[0].index(name) for name in ("kind", "verdict")]
    assert lines[0].split("  ")[0] == "direction"
    assert [line[columns[0] :].split()[0] for line in lines[1:3]] == ["predicted", "tuned"]
    assert [line[columns[1] :] for line in lines[1:3]] == ["outside 1 sd", "within 1 sd"]
    assert any(line.startswith("tuned: ") for line in lines) and not any(line.startswith("input: ") for line in lines)
    assert lines[-1] == f"run folder: {weft().folder}" and "\x1b" not in text
    rows = [HEADER, ("warp", "q", "5", "1", "2", "k", "v"), ("weft", "q", "5000", "1", "2", "k", "v")]
    lines = [line for row in table(rows, right=(2, 3, 4)) for line in row]
    assert lines[1].index("5") == lines[2].index("5000") + 3  # numbers to the right


def test_a_narrow_terminal_keeps_the_folder_in_one_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "40")
    assert f"run folder:\n  {weft().folder}\n" in printed(weft(), stream=Terminal())
    monkeypatch.setenv("COLUMNS", "120")
    text = printed(weft(), stream=(stream := Terminal()))
    assert "outside 1 sd" in plain(stream) and "7332 ± 380" in plain(stream) and plain(stream) != text


def test_an_ascii_stream_gets_ascii() -> None:
    raw = io.BytesIO()
    stream = io.TextIOWrapper(raw, encoding="ascii")
    print_results([weft()], stream)
    assert b"7332 +- 380" in raw.getvalue()


def test_json_is_one_object_without_nan() -> None:
    stream = io.StringIO()
    print_json({"a": math.nan, "b": [1.5]}, stream)
    assert json.loads(stream.getvalue()) == {"a": None, "b": [1.5]}


def test_a_closed_standard_output_ends_in_silence() -> None:
    script = (
        "from knittest.runs.terminal_output import print_json\n"
        "print_json({'a': list(range(200000))})\nprint_json({'a': 1})\nimport sys; print('end', file=sys.stderr)"
    )
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout is not None and process.stderr is not None
    process.stdout.close()
    assert process.wait(60) == 0 and process.stderr.read() == b"end\n"
    process.stderr.close()


@pytest.mark.parametrize(
    ("value", "form", "text"),
    [
        (0.0178, "{:.2f}", "0.018"), (0.21, "{:.2f}", "0.21"), (0.2, "{:.2f}", "0.20"), (1.0, "{:.0f}", "1"),
        (0.00004, "{:+.4f}", "+4e-05"), (-0.003, "{:.2f}", "-0.003"), (3e-17, "{:.2f}", "0.00"), (0.0, "{:.1f}", "0.0"),
    ],
)  # fmt: skip
def test_small_numbers_keep_two_digits(value: float, form: str, text: str) -> None:
    assert _number_text(value, form) == text
