"""Pull-out: results of a curve, the piece of a run, and how its rows and curves are compared."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from export_sample import cost, quality, strip
from pull_out_files import CROSSINGS, FRICTION, LENGTH, PITCH, export, pull

from knittest.base.errors import InputError
from knittest.base.history import Frame, History, Mesh, Specimen
from knittest.config.loading import resolve
from knittest.config.studies import parse_calibration
from knittest.config.yaml_loader import load_yaml
from knittest.experiment.comparison import compare_columns
from knittest.experiment.conditions import UNKNOWN
from knittest.experiment.curves import load_curve
from knittest.experiment.tables import published_rows
from knittest.fabric.strip import YarnPath
from knittest.laboratory.fabric_test import FabricTest
from knittest.laboratory.pull_out.lab_files import LAB, UNITS
from knittest.laboratory.pull_out.sliding import SLIDES, evaluate_sliding
from knittest.laboratory.pull_out.test import (
    REST,
    PullOut,
    PullOutTest,
    add_tail_travel,
    clamp_difference,
    loose_inlay_text,
    nodes_of,
)
from knittest.laboratory.report_base import REPORTS
from knittest.runs.run_files import compare_run, references_of
from knittest.studies.calibrate.targets import targets_of


def quick(*sets: str, direction: str = "weft"):
    """Run of yarns of variant 1 at quick."""
    return resolve(variant="1", preset="quick", test="pull-out", direction=direction, sets=sets)


def pulled(length: float, travel: float, friction: float, pitch: float = 4.0) -> dict[str, np.ndarray]:
    """Curve of an inlay, ``length`` embedded, held by ``friction`` a crossing; it stretches by 0.2 mm."""
    way = np.linspace(0.0, travel, 4001)
    tail = np.maximum(way - 0.2, 0.0)
    embedded = length - tail
    held = friction * embedded / pitch
    return {"tail_travel_mm": tail, "embedded_mm": embedded, "pull_force_n": np.minimum(way / 0.2, 1.0) * held}


def test_friction_of_a_crossing_from_a_force_that_falls_with_the_embedded_length():
    found = evaluate_sliding(pulled(40.0, 12.0, 0.05), 4.0)
    assert found.per_crossing == pytest.approx(0.05, rel=1e-4)
    assert found.peak == pytest.approx(10 * 0.05, rel=2e-3) and found.force_at_rest == pytest.approx(
        10 * 0.05, rel=2e-3
    )
    assert found.way == pytest.approx(11.8 - SLIDES)
    # two whole pitches, the last ones: 28.2 to 36.2 mm embedded
    assert found.mean == pytest.approx(0.05 * 32.2 / 4.0, rel=1e-3)


def test_a_force_that_comes_back_every_pitch_has_its_mean_over_whole_ones():
    curve = pulled(40.0, 12.0, 0.05)
    curve["pull_force_n"] = curve["pull_force_n"] * (1.0 + np.sin(2.0 * np.pi * curve["tail_travel_mm"] / 4.0) ** 2)
    assert evaluate_sliding(curve, 4.0).per_crossing == pytest.approx(0.075, rel=4e-3)


def test_an_inlay_that_hardly_slides_has_no_friction():
    found = evaluate_sliding(pulled(40.0, 3.0, 0.05), 4.0)
    assert np.isnan(found.mean) and np.isnan(found.per_crossing) and found.way == pytest.approx(2.8 - SLIDES)
    assert np.isnan(evaluate_sliding(pulled(40.0, 0.1, 0.05), 4.0).force_at_rest)


def paths(n_wales: int = 6, n_courses: int = 6) -> list[YarnPath]:
    """Straight inlays of the pitches of variant 1 and a flat zigzag for each row of loops, in any order."""
    pitch, found = 100.0 / 28.0, []
    for c in range(n_courses):
        x = np.linspace(0.0, n_wales * pitch, 25)
        found.append(YarnPath("weft", c, np.column_stack([x, np.full(25, (c + 0.5) * pitch), np.zeros(25)])))
        found.append(YarnPath("knit", c, np.column_stack([x, np.full(25, (c + 0.6) * pitch), np.ones(25)])))
    for w in range(n_wales):
        y = np.linspace(0.0, n_courses * pitch, 25)
        found.append(YarnPath("warp", w, np.column_stack([np.full(25, (w + 0.5) * pitch), y, np.zeros(25)])))
    return found


@pytest.mark.parametrize("direction", ["warp", "weft"])
@pytest.mark.parametrize("clamped", ["sides", "far"])
def test_clamps_hold_the_piece_but_not_the_inlay(direction, clamped):
    run, size = quick(f"rig.clamped_edges={clamped}", direction=direction), (600.0 / 28.0, 600.0 / 28.0)
    nodes = nodes_of(run, paths(), size)
    order = ["warp", "weft", "knit"]
    points = np.concatenate([p.points for p in sorted(paths(), key=lambda p: (order.index(p.system), p.index))])
    axis = 1 if direction == "warp" else 0
    assert points[nodes.pulled[0], axis] == pytest.approx(size[0]) and points[nodes.tail, axis] == 0.0
    own = points[nodes.tail, 1 - axis]
    assert own == pytest.approx(3.5 * 100.0 / 28.0) and points[nodes.pulled[0], 1 - axis] == own
    held = points[nodes.held]
    along, across = held[:, axis], held[:, 1 - axis]
    on_it = (across == own) & (held[:, 2] == 0.0)
    pitch = 100.0 / 28.0 + 1e-9
    if clamped == "sides":
        assert ((across <= pitch) | (across >= size[0] - pitch)).all() and not on_it.any()
        assert np.isclose(across, 0.5 * pitch).any() and np.isclose(across, size[0] - 0.5 * pitch).any()
    else:
        assert along.max() <= pitch and nodes.tail not in nodes.held
    assert len(held) > 50


def test_the_piece_rests_then_the_end_is_drawn_by_the_travel():
    run = quick()
    rig = PullOutTest(run, 0, np.array([3]), np.array([0]), 20.0)
    assert rig.speed.integral(REST) == 0.0
    assert rig.speed.integral(rig.duration) == pytest.approx(run.rig.travel)
    row = rig.channels(rig.duration, SimpleNamespace(reaction=np.array([0.7, -0.6])))
    assert row["pull_force_n"] == 0.7 and row["clamp_force_n"] == 0.6
    early = [mark * rig.duration for mark in rig.marks]
    assert [rig.speed.integral(t) for t in early[1:]] == pytest.approx(list(np.linspace(0.0, 1.0, 17)[1:]), abs=2e-3)


def test_the_free_end_is_followed_through_the_frames():
    curve = {"time_ms": np.array([5.0, 10.0]), "displacement_mm": np.array([0.0, 2.0])}
    curve |= {"pull_force_n": np.array([0.0, 2.0]), "clamp_force_n": np.array([0.0, 1.9])}
    frames = [
        Frame(t, 0.0, 0.0, np.array([[0.0, 0.0, 0.0], [x, 0.0, 0.0]]), {}) for t, x in ((0, 0.1), (5, 0.3), (10, 2.0))
    ]
    mesh = Mesh("beams", np.zeros((0, 2), np.int64), np.zeros(0), (), np.zeros(0), np.zeros(0))
    history = add_tail_travel(History(mesh, curve, {}, frames), {"tail_node": 1.0, "embedded_mm": 20.0}, 0)
    assert history.curve["tail_travel_mm"] == pytest.approx([0.0, 1.7])
    assert history.curve["embedded_mm"] == pytest.approx([20.0, 18.3])
    assert clamp_difference(history) == pytest.approx(5.0)


@pytest.mark.parametrize(("times", "is_loose"), [(9.0, True), (11.0, False)])
def test_an_inlay_that_slides_under_its_weight_is_loose(times, is_loose):
    """1200 tex of 20 mm, 24 mg, weigh 0.235 mN."""
    run = quick()
    pull = np.full(10, times * 1200e-6 * 20.0 * 9.81e-3)
    text = loose_inlay_text(run, 20.0, SimpleNamespace(curve={"pull_force_n": pull}))
    assert bool(text) == is_loose
    if is_loose:
        assert text.startswith(
            "the weft inlay lies loose in the fabric: its mean pull force is 0.0021 N, less than 10 "
        )
        assert "its weight of 0.00024 N" in text and "loop_length (now 14.4 mm)" in text


def test_a_loose_inlay_is_named_before_the_checks_that_fail_by_it(monkeypatch):
    run, facts = quick(), {"embedded_mm": 20.0, "pitch_mm": 4.0}
    monkeypatch.setattr(FabricTest, "assess", lambda *_: replace(quality(), failures=("kinetic energy",)))
    monkeypatch.setattr(PullOut, "results", lambda *_: {"slid_mm": 0.0, "pull_out_sliding_n": float("nan")})
    history = SimpleNamespace(curve={"pull_force_n": np.full(10, 1e-6)})
    found = PullOut().assess(run, SimpleNamespace(facts=facts), history, None)
    assert len(found.failures) == 2 and "lies loose" in found.failures[0]


@pytest.mark.parametrize(
    ("sets", "said"),
    [
        (("rig.width=12",), r"rig.width = 12 mm has 3 courses, expected at least 5.*rig.width=18"),
        (("rig.length=10",), r"rig.travel = 8 mm: expected at most 6.43 mm.*rig.length = 10 mm"),
        (("model.meso.contact=false",), "model.meso.contact = false"),
    ],
)
def test_pieces_without_a_pull_out_are_refused(sets, said):
    with pytest.raises(InputError, match=said):
        PullOut().check_run(quick(*sets))


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """Experiment of three inlays, mu N 0.019, 0.02, 0.021 N, in the working folder."""
    monkeypatch.chdir(tmp_path)
    files = [export(tmp_path / f"weft-{k}.csv", friction=f) for k, f in enumerate((0.019, 0.02, 0.021))]
    LAB.write([pull(path) for path in files], tmp_path / "data" / "mine", "weft", [path.name for path in files])
    return tmp_path / "data" / "mine"


def run(*sets):
    fabric = ('fabric.experiment="mine"', 'fabric.experiment_variant="mine"')
    return resolve(test="pull-out", variant="1", preset="quick", direction="weft", sets=[*fabric, *sets])


def test_rows_are_those_of_a_run_of_the_same_piece(mine):
    rows = published_rows(mine, "mine", "weft", tuple(UNITS))
    at_rest = rows[0]
    assert [row.quantity for row in rows] == list(UNITS) and {row.unit for row in rows} == {"N"}
    assert (at_rest.mean, at_rest.sd, at_rest.n) == (
        pytest.approx(FRICTION * CROSSINGS, rel=3e-3), pytest.approx(0.001 * CROSSINGS, rel=3e-3), 3,
    )  # fmt: skip
    same = run("rig.length=50", "rig.travel=19")
    assert REPORTS["pull-out"].scaled(same, rows) == rows and REPORTS["pull-out"].apart(same, rows) == []


@pytest.mark.parametrize(
    ("sets", "kept", "said"),
    [
        (
            (), ["crossing_friction_at_rest_n", "crossing_friction_n"],
            r"pull_out_peak_n, pull_out_sliding_n .*: 50 mm embedded, in the run 21\.4 mm: .*--set rig\.length=50",
        ),
        (("rig.length=50",), [name for name in UNITS if name != "pull_out_sliding_n"],
         r"mean over 5 pitches, in the run over 2: .*--set rig\.travel=18\.9"),
        (("rig.length=50", "rig.travel=19", "rig.clamped_edges=far"), [],
         "both sides clamped, in the run the far end clamped: .*--set rig.clamped_edges=sides"),
        (("rig.length=50", "rig.travel=19", "fabric.warp_density=24"), [],
         "28 crossing yarns per 100 mm, in the run 24: another fabric"),
    ],
)  # fmt: skip
def test_another_piece_is_not_compared_in_silence(mine, sets, kept, said):
    rows, report = published_rows(mine, "mine", "weft", tuple(UNITS)), REPORTS["pull-out"]
    found = report.scaled(run(*sets), rows)
    assert [row.quantity for row in found] == kept
    assert report.apart(run(*sets), rows)[0].startswith("not compared: ")
    assert re.search(said, report.apart(run(*sets), rows)[0])
    if not sets:
        assert "of 14 instead of 6 crossings" in found[0].table
    bare = [replace(row, conditions=UNKNOWN) for row in rows]
    assert report.scaled(run(*sets), bare) == [] and "unknown embedded length" in report.apart(run(*sets), bare)[0]


def test_a_run_of_another_piece_warns_and_compares_what_is_left(mine):
    one, columns = run(), {"tail_travel_mm": np.zeros(1), "pull_force_n": np.zeros(1)}
    results = {"pull_out_at_rest_n": 0.1, "crossing_friction_at_rest_n": 0.019}
    specimen = Specimen(History(strip(2, 2)[0], columns, {}, []), results, quality(), cost(), {})
    found = compare_run(one, [specimen], references_of(one, ()))
    (row,) = found.comparison["rows"]
    assert row["quantity"] == "crossing_friction_at_rest_n"
    assert row["deviation_sd"] == pytest.approx(-1.0, abs=0.1)
    assert any("pull_out_at_rest_n" in text and "rig.length=50" in text for text in found.summary["warnings"])


def test_the_corridor_is_a_curve_to_compare_with(mine):
    curve = load_curve(mine / "pull-out-weft" / "corridor.csv")
    assert (curve.x_name, curve.y_name) == ("tail_travel_mm", "pull_force_n") and curve.sd is not None
    same, report = run("rig.length=50", "rig.travel=19"), REPORTS["pull-out"]
    reference = report.scale_curve(same, curve)
    tail = np.linspace(0.0, 18.0, 400)
    columns = {"displacement_mm": tail + 0.1, "tail_travel_mm": tail, "pull_force_n": 0.018 * (LENGTH - tail) / PITCH}
    told = compare_columns(columns, reference)
    assert told["comparable"] and told["kinetic_error_pct"] == pytest.approx(-10.0, abs=0.1)
    with pytest.raises(InputError, match=r"corridor\.csv: 50 mm embedded, in the run 21\.4 mm"):
        report.scale_curve(run(), curve)


def test_a_calibration_takes_the_rows_and_refuses_those_of_another_piece(mine):
    text = """base: {{variant: "1", scale: meso, preset: quick}}
parameters:
  fabric.contact.friction_coefficient: {{low: 0.1, high: 0.6}}
tests:
  pull: {{test: pull-out, direction: weft}}
targets:
  - {{test: pull, quantity: {0}}}
"""

    def targets(quantity):
        path = mine.parent / "calibration.yaml"
        path.write_text(text.format(quantity))
        document = load_yaml(path)
        return targets_of(parse_calibration(document), document, {"pull": run()})

    (one,) = targets("crossing_friction_at_rest_n")
    assert (one.mean, one.sd) == (pytest.approx(FRICTION, rel=3e-3), pytest.approx(0.001, rel=3e-3))
    with pytest.raises(InputError, match=r"pull_out_at_rest_n: not compared: .*rig\.length=50.*or add value and sd"):
        targets("pull_out_at_rest_n")
