"""The breaks that show what verification tests notice stand in the code as it is."""

import pytest

from benchmarks.breaks import BREAKS, ROOT, _left_out


@pytest.mark.parametrize("change", BREAKS, ids=lambda b: f"{b.file}: {b.what}")
def test_a_break_finds_its_line_and_its_test(change):
    file, name = change.test.split("::")
    assert (ROOT / "knittest" / change.file).read_text(encoding="utf-8").count(change.old) >= 1
    assert f"def {name}" in (ROOT / "tests" / "verification" / file).read_text(encoding="utf-8")


def test_the_copy_of_the_tree_is_whole():
    assert _left_out(str(ROOT), ["runs", ".git", "knittest"]) == {"runs", ".git"}
    assert _left_out(str(ROOT / "knittest"), ["runs", "__pycache__"]) == {"__pycache__"}
