"""Import of compaction tests: thickness at pressures, units, first loading, slips that are refused, and calibration."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from strip_reading import refused

from knittest.experiment.lab_table import ReadOptions
from knittest.experiment.lab_tests import LAB_TESTS, read_files
from knittest.experiment.tables import published_rows
from knittest.laboratory.compaction.lab_files import LAB

HEAD = "Dicke [mm];Druck [kPa]\n"


def law(pressure, start=3.0):
    """Falls by 0.2 mm a decade from ``start`` [mm] at 1 kPa."""
    return start - 0.2 * np.log10(pressure)


def export(path, start=3.0, most=1000.0, head=HEAD, factor=1.0, more=""):
    pressure = np.geomspace(0.1, most, 41)
    rows = "".join(f"{t:.6f};{p * factor:.8g}\n" for t, p in zip(law(pressure, start), pressure, strict=True))
    path.write_text(head + rows.replace(".", ",") + more, encoding="utf-8")
    return path


def test_thickness_at_the_pressures_of_a_run(tmp_path):
    (piece,) = LAB.read(export(tmp_path / "a.csv", most=300.0), ReadOptions())
    found = LAB.results([piece], "", []).found
    assert {name: float(v[0]) for name, v in found.items()} == pytest.approx(
        {f"thickness_mm_at_kpa.{p}": law(p) for p in (1, 10, 100)}, abs=1e-5
    )


@pytest.mark.parametrize(
    ("unit", "factor", "more"),
    [("MPa", 1e-3, ""), ("Pa", 1e3, ""), ("kPa", 1.0, "2,0;500\n1,9;100\n1,8;1\n")],  # the last one is unloaded
)
def test_units_are_read_and_unloading_is_left_out(tmp_path, unit, factor, more):
    path = export(tmp_path / "a.csv", head=f"thickness [mm];pressure [{unit}]\n", factor=factor, more=more)
    (piece,) = LAB.read(path, ReadOptions())
    assert piece.pressure[-1] == pytest.approx(1000.0)
    assert piece.at(np.array([100.0]))[0] == pytest.approx(law(100.0), abs=1e-5)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("thickness;pressure\n3;1\n2;10\n", r"a\.csv:1: column 'pressure' has no unit of pressure"),
        (HEAD + "1;1\n2;10\n3;100\n", "expected the distance of the plates, which falls, not their travel"),
        (HEAD + "300;1\n200;10\n100;100\n", r"expected 0\.05 to 50 mm: check the unit of the thickness"),
        (HEAD + "3;0,001\n2,9;0,01\n2,8;0,1\n", "check the unit of the pressure"),
        ("Dicke [mm];Kraft [N]\n3;1\n2;10\n", "the file states no plate diameter: give --plate-diameter"),
    ],
)
def test_a_table_that_is_no_compaction_is_refused(tmp_path, text, said):
    path = tmp_path / "a.csv"
    path.write_text(text)
    refused(said, lambda: LAB.read(path, ReadOptions()))


def test_pieces_of_another_unit_copies_and_pressures_apart_are_refused(tmp_path):
    one = LAB.read(export(tmp_path / "a.csv"), ReadOptions())[0]
    thick = LAB.read(export(tmp_path / "b.csv", start=15.0), ReadOptions())[0]
    refused("thickness", LAB.results, [one, thick], "", [])
    refused(r"a\.csv|copies|same", LAB.results, [one, one], "", [])
    short = LAB.read(export(tmp_path / "c.csv", start=3.1, most=0.9 / 0.8), ReadOptions())[0]
    short = replace(short, pressure=short.pressure[:-5], thickness=short.thickness[:-5])
    refused("expected one of 1, 10, 100, 1000 kPa", LAB.results, [one, short], "", [])


def test_an_import_is_an_experiment_whose_rows_a_run_is_held_against(tmp_path):
    """Thickness, mean and sd of three pieces; runs of this fabric end at the largest pressure that was measured."""
    files = [export(tmp_path / f"{k}.csv", start=3.0 + 0.1 * k, most=300.0) for k in range(3)]
    out = tmp_path / "mine"
    pieces = read_files("compaction", files, {})
    LAB_TESTS["compaction"].write(pieces, out, None, [f.name for f in files])
    rows = published_rows(out, "mine", "", ("thickness_mm_at_kpa.1", "thickness_mm_at_kpa.100"))
    assert [(r.mean, r.sd, r.n, r.unit) for r in rows] == [
        (pytest.approx(3.1, abs=1e-5), pytest.approx(0.1, abs=1e-5), 3, "mm"),
        (pytest.approx(2.7, abs=1e-5), pytest.approx(0.1, abs=1e-5), 3, "mm"),
    ]
    statistics = json.loads((out / "compaction" / "statistics.json").read_text())
    assert LAB.rigs({"compaction": statistics}) == {"compaction": {"max_pressure": 100.0}}
    corridor = pd.read_csv(out / "compaction" / "corridor.csv", comment="#")
    assert corridor["thickness_mm"].iloc[0] == pytest.approx(law(0.1, 3.1), abs=1e-5)
    assert corridor["thickness_sd_mm"].to_numpy() == pytest.approx(0.1, abs=1e-5)


@pytest.mark.parametrize(
    ("head", "inch", "factor"),
    [
        ("Plate diameter;25;mm\nThickness [mm];Load [N]", 1.0, 0.25e-3 * np.pi * 25.0**2),
        ("Pressure foot area;5;cm2\nThickness [mm];Load [N]", 1.0, -0.5),
        ("Thickness [in.];Pressure [psi]", 25.4, 1.0 / 6.894757),
    ],
)
def test_a_force_is_a_pressure_by_the_plate_and_units_are_converted(tmp_path, head, inch, factor):
    pressure = np.geomspace(0.5, 200.0, 60)
    rows = "".join(f"{(2.2 - 0.1 * np.log(p)) / inch:.6f};{p * factor:.6f}\n" for p in pressure)
    (tmp_path / "a.csv").write_text(f"{head}\n{rows}", encoding="utf-8")
    (piece,) = LAB.read(tmp_path / "a.csv", ReadOptions())
    assert piece.at(np.array([1.0, 10.0, 100.0])) == pytest.approx([2.2, 1.9697, 1.7395], abs=1e-4)
