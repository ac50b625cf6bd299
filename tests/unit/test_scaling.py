"""Memory and time of large models, and the scripts that measure them and other codes beside this one."""

import tracemalloc

import numpy as np
import pytest

from benchmarks import peers, scaling
from knittest.pose import Body, Chain, YarnContact, round_section


def held(beams: int) -> float:
    """Bytes that a body of rods in contact holds, once it can move, over its beams."""
    along = np.arange(beams // 100 + 1.0)
    section = round_section(modulus=60e3, diameter=1.0, density=2.5e-3)
    rods = [Chain(np.column_stack([along, np.full_like(along, 0.99 * k), 0.0 * along]), section) for k in range(100)]
    tracemalloc.start()
    body = Body.of_chains(rods, YarnContact(100.0, 50.0, 0.3), threads=1)
    body.start()
    bytes_held, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return bytes_held / beams


def test_a_beam_takes_less_than_a_kilobyte_however_many_there_are() -> None:
    held(1000)  # loads what every body holds
    small, large = held(10_000), held(30_000)
    assert 300.0 < large < 1300.0
    assert large == pytest.approx(small, rel=0.15)


def test_far_from_linear_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    few, many = scaling.Built(100, 20, 0.1, 60_000, 70_000), scaling.Built(1000, 200, 1.0, 900_000, 900_000)
    scaling.report("beams", [(few, 2e-6), (many, 40e-6)])
    said = capsys.readouterr().out
    assert "| 100 | 0.20 | 0.002 | 20.0 | 0.60 | 0.70 | 0.1 |" in said
    assert "time: -33 to +33 % of the mean" in said and "memory: -20 to +20 % of the mean" in said


def test_strips_have_as_many_beams_as_asked_for_and_a_gauge_of_four_widths() -> None:
    run = scaling.strip(100_000)
    assert run.rig.gauge_length == pytest.approx(4.0 * run.rig.width, rel=1e-3)  # type: ignore[attr-defined]
    assert run.rig.gauge_length * run.rig.width * scaling.DENSITY == pytest.approx(1e5, rel=1e-2)  # type: ignore[attr-defined]


def test_crossed_rods_touch_at_every_crossing() -> None:
    points = peers.lines(crossed=True)
    assert len(points) == 20 and {len(one) for one in points} == {101}
    gaps = [peers._gap(one.T, other.T) for one in points[:10] for other in points[10:]]
    assert np.allclose(gaps, peers.DIAMETER - peers.DEPTH)
    advance, _, touching = peers.ours(crossed=True)
    advance(20)
    assert touching() == 100


def test_a_peer_that_is_missing_is_named_and_what_each_lacks(monkeypatch: pytest.MonkeyPatch) -> None:
    spent = {"here": 0}

    def make(_: bool) -> peers.Case:
        def advance(steps: int) -> None:
            spent["here"] += steps

        return advance, 0.2, lambda: 7

    monkeypatch.setattr(peers, "CODES", {"knittest": ("knittest", make), "PyElastica": ("not_there_at_all", make)})
    monkeypatch.setattr(peers, "_turn", lambda advance, steps: advance(steps) or 1e-3 * steps)
    rows = list(peers.table(crossed=True, turns=3))
    assert rows[0].startswith("| 2,000 elements")
    assert f"| knittest | 7 | 0.2 | 2 | {peers.LACKS['knittest']} |" in rows
    assert f"| PyElastica | not installed | | | {peers.LACKS['PyElastica']} |" in rows


def test_memory_is_that_of_the_model_also_of_a_small_one() -> None:
    """In processes of their own: three and twelve thousand beams hold 0.3 to 1.3 kB each, as the trace of ours says."""
    rows = scaling.measured([scaling.strip(3_000), scaling.strip(12_000)], scaling.TURN)
    for fact, step in rows:
        assert 300.0 < fact.held / fact.elements < 1300.0 and fact.most >= fact.held and step > 0.0
    assert rows[0][0].held < 0.5 * rows[1][0].held
