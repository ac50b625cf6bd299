"""Bands of shear over what nobody measured: in the shipped table, on the terminal, on a page, in the verdict."""

from types import SimpleNamespace

import pytest

from docs.lost import cause, causes
from docs.validation_order import lost_text, verdict
from knittest.experiment.tables import shear_bands
from knittest.report_page.studies import studies
from knittest.runs.terminal_output import band_line
from knittest.studies.uncertainty.outcome import VariableRow

FABRICS = ("pham2019-v1", "pham2019-v2")


def outcome(test: str, fabric: str) -> SimpleNamespace:
    return SimpleNamespace(run=SimpleNamespace(rig=SimpleNamespace(kind=test), fabric=SimpleNamespace(name=fabric)))


@pytest.mark.parametrize("fabric", FABRICS)
def test_shipped_bands_rise_with_the_angle_and_hold_their_median(fabric):
    bands = shear_bands(fabric)
    assert [band.angle for band in bands] == [10.0, 20.0, 30.0, 40.0]
    assert all(0.0 < b.low < b.middle < b.high and 20 <= b.count <= b.points for b in bands)
    assert bands[0].middle < bands[1].middle < bands[2].middle
    assert shear_bands("mine") == []


def test_a_test_that_shears_a_studied_fabric_says_its_band():
    first = shear_bands(FABRICS[0])[0]
    for test in ("picture-frame", "forming"):
        assert f"{first.low:.2g} to {first.high:.2g} at 10 deg" in band_line(outcome(test, FABRICS[0]))
    assert band_line(outcome("tensile", FABRICS[0])) == band_line(outcome("forming", "mine")) == ""


def test_the_page_of_a_frame_has_the_table_and_says_that_it_is_not_this_run(monkeypatch):
    from knittest.report_page import studies as page

    monkeypatch.setattr(page, "speed_rows", lambda *asked: [])
    run = SimpleNamespace(
        rig="forming", run=None, number=1, summary=SimpleNamespace(scale="macro"),
        setting=lambda *path: FABRICS[1] if path == ("fabric", "name") else None,
    )  # fmt: skip
    (section,) = studies(run)
    table, note = section.blocks
    assert "not this run" in table.caption and len(table.rows) == 4 and "force of the stamp" in note.text
    run.rig = "tensile"
    assert studies(run) == []


@pytest.mark.parametrize(
    ("band", "told"),
    [
        ([0.5, 0.8, 0.9], "passed"), ([0.5, 0.8, 1.2], "passed, within the band open"), ([1.1, 1.2, 1.3], "**FAILED**"),
        ([0.9, 1.2, 1.3], "**FAILED**, within the band open"), ([], "not known"),
    ],
)  # fmt: skip
def test_the_verdict_is_that_of_the_median_and_open_where_the_band_holds_one(band, told):
    assert verdict(VariableRow(name="V2/V1", band=band)) == told


def test_a_lost_run_is_counted_with_every_gate_that_it_did_not_pass():
    reason = (
        "energy error 3.16 % is above 2 %; it goes with the step: solver.safety=0.39 would pass; damping of contacts "
        "over work 25.30 % is above 5 %; it falls with the speed: try solver.speed=0.25; contact forces of the settled "
        "cell are 1.3 times those on a fine mesh, 0.8 to 1.2 are allowed: model.meso.elements_per_loop=64 would pass"
    )
    assert causes(reason) == ["energy error", "damping of contacts", "mesh too coarse for the draw-in"]
    assert cause(reason) == "energy error"
    assert causes("the motion blows up at 3.1 ms; reduce solver.safety") == [cause("node 3 is not finite")]


def test_the_page_says_of_how_many_cells_a_shorter_run_counts():
    stored = {"lost_of": {"V1": 3}, "causes": {"V1": {"kinetic energy": 1, "energy error": 3}}, "counts_to": {"V1": {}}}
    assert lost_text("V1", stored, 8) == "V1 3 of 8 (3 energy error, 1 kinetic energy)"
    stored["counts_to"]["V1"] = {"31": 2, "11": 1}
    assert lost_text("V1", stored, 8).endswith(" of which 2 count to 31 deg, 1 to 11 deg")
