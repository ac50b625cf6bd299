"""Bands of shear over what nobody measured: in the shipped table, on the terminal, on a page, in the verdict."""

from types import SimpleNamespace

import pytest

from docs.validation_order import verdict
from knittest.experiment.simulated_studies import shear_bands
from knittest.report_page.studies import studies
from knittest.runs.show import band_line
from knittest.studies.uncertainty.written import VariableRow

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
    assert "not this run" in table.caption and len(table.rows) == 4 and "the stamp too" in note.text
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
