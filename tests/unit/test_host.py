"""Share of the processors' time that a host takes."""

import pytest

from knittest.base.machine import processor_ticks, steal_share


def test_steal_is_the_eighth_field_and_guests_are_not_counted_twice(tmp_path):
    stat = tmp_path / "stat"
    stat.write_text("cpu  100 1 20 800 5 0 4 70 99 9\ncpu0 1 1 1 1 1 1 1 1 1 1\n")
    assert processor_ticks(stat) == (70, 1000)
    assert steal_share((70, 1000), (80, 1200)) == pytest.approx(0.05)
    assert steal_share(None, (80, 1200)) is steal_share((70, 1000), None) is steal_share((70, 1000), (70, 1000)) is None


@pytest.mark.parametrize("text", ["", "cpu", "cpu 1 2 3", "cpu0 1 2 3 4 5 6 7 8", "cpu a b c d e f g h"])
def test_what_does_not_tell_is_not_known(tmp_path, text):
    stat = tmp_path / "stat"
    stat.write_text(text)
    assert processor_ticks(stat) is None
    assert processor_ticks(tmp_path / "none") is None
