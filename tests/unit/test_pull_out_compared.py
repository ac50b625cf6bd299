"""Pull-outs of a laboratory beside runs and as targets: what is of another piece is not compared in silence."""

import re
from dataclasses import replace

import numpy as np
import pytest
from export_sample import cost, quality, strip
from pull_out_files import CROSSINGS, FRICTION, LENGTH, PITCH, export, pull

from knittest.base.errors import InputError
from knittest.base.history import History, Specimen
from knittest.config.loading import resolve
from knittest.config.studies import parse_calibration
from knittest.config.yaml_loader import load_yaml
from knittest.experiment.compare import compare_columns
from knittest.experiment.conditions import UNKNOWN
from knittest.experiment.curves import load_curve
from knittest.experiment.tables import published
from knittest.laboratory.pull_out.lab_files import LAB, UNITS
from knittest.laboratory.report_base import REPORTS
from knittest.runs.writing import judge, references_of
from knittest.studies.calibrate.targets import targets_of


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
    rows = published(mine, "mine", "weft", tuple(UNITS))
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
            r"pull_out_peak_n, pull_out_sliding_n .*: 50 mm embedded, in the run 21\.4 mm: --set rig\.length=50",
        ),
        (("rig.length=50",), [name for name in UNITS if name != "pull_out_sliding_n"],
         r"mean over 5 pitches, in the run over 2: --set rig\.travel=18\.9 makes them comparable"),
        (("rig.length=50", "rig.travel=19", "rig.clamped=far"), [],
         "both sides clamped, in the run the far end clamped: --set rig.clamped=sides"),
        (("rig.length=50", "rig.travel=19", "fabric.warp_density=24"), [],
         "28 crossing yarns per 100 mm, in the run 24: another fabric"),
    ],
)  # fmt: skip
def test_another_piece_is_not_compared_in_silence(mine, sets, kept, said):
    rows, report = published(mine, "mine", "weft", tuple(UNITS)), REPORTS["pull-out"]
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
    found = judge(one, [specimen], references_of(one, ()))
    (row,) = found.comparison["rows"]
    assert row["quantity"] == "crossing_friction_at_rest_n"
    assert row["deviation_sd"] == pytest.approx(-1.0, abs=0.1)
    assert any("pull_out_at_rest_n" in text and "rig.length=50" in text for text in found.summary["warnings"])


def test_the_corridor_is_a_curve_to_compare_with(mine):
    curve = load_curve(mine / "pull-out-weft" / "corridor.csv")
    assert (curve.x_name, curve.y_name) == ("tail_travel_mm", "pull_force_n") and curve.sd is not None
    same, report = run("rig.length=50", "rig.travel=19"), REPORTS["pull-out"]
    reference = report.matched(same, curve)
    tail = np.linspace(0.0, 18.0, 400)
    columns = {"displacement_mm": tail + 0.1, "tail_travel_mm": tail, "pull_force_n": 0.018 * (LENGTH - tail) / PITCH}
    told = compare_columns(columns, reference)
    assert told["comparable"] and told["kinetic_error_pct"] == pytest.approx(-10.0, abs=0.1)
    with pytest.raises(InputError, match=r"corridor\.csv: 50 mm embedded, in the run 21\.4 mm"):
        report.matched(run(), curve)


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
