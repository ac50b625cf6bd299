"""``knittest bench --against``: two checkouts by turns."""

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from knittest.base.errors import InputError
from knittest.cli.system import bench
from knittest.runs import bench_comparison
from knittest.runs.bench_comparison import difference_text, paired_lines

HERE = Path(bench_comparison.__file__).resolve().parents[2]
TINY = "tensile --variant 1 --scale macro --direction warp --set rig.gauge_length=40 --set rig.width=40"


def test_curves_differ_in_percent_of_their_largest_value() -> None:
    old = np.array([[0.0, 0.0], [1.0, 50.0], [2.0, -200.0]])
    assert difference_text(old, old.copy()) == "identical"
    new = old.copy()
    new[1, 1] = 51.0
    assert difference_text(old, new) == "off by 0.5 %"
    assert difference_text(old, new[:2]) == "2 rows, not 3"
    new = old.copy()
    new[1, 1] = np.nan
    assert difference_text(old, new) == difference_text(new, old) == "gaps differ"


def test_a_checkout_beside_itself_has_the_same_curve(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_comparison, "CASES", {"strip": TINY})
    *_, line = paired_lines(HERE, 1)
    found = re.fullmatch(r"strip +(\S+) +(\S+) \((\S+) to (\S+)\) +(\S+) +identical", line)
    assert found, line
    speed, *ratios = map(float, found.groups())
    assert speed > 0.0 and all(0.05 < ratio < 20.0 for ratio in ratios)


def test_the_ratio_is_of_this_one_over_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    curve = np.zeros((2, 2))
    runs = {True: bench_comparison.TimedRun(3e6, 2.0, curve), False: bench_comparison.TimedRun(1e6, 8.0, curve)}
    monkeypatch.setattr(bench_comparison, "CASES", {"strip": TINY})
    monkeypatch.setattr(bench_comparison, "check_checkout", lambda path: path)
    monkeypatch.setattr(bench_comparison, "_time_run", lambda place, command: runs[place == HERE])
    *_, line = paired_lines(Path("other"), 3)
    assert line.split() == ["strip", "3", "3.00", "(3.00", "to", "3.00)", "4.00", "identical"]


def test_what_is_no_checkout_or_fails_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="expected a checkout of knittest"):
        list(paired_lines(tmp_path, 1))
    monkeypatch.setattr(bench_comparison, "CASES", {"strip": "tensile --variant none"})
    with pytest.raises(InputError, match=r"exit code 2.*none"):
        list(paired_lines(HERE, 1))


def test_options_that_would_be_ignored_are_refused() -> None:
    result = CliRunner().invoke(bench, ["--against", str(HERE), "--preset", "paper"])
    assert isinstance(result.exception, InputError) and "--preset" in str(result.exception)
