"""Peaks beyond the first failure: found in the curves, said under the table and on the page, and only where true."""

import numpy as np
import pytest
from report_sample import write_run

from knittest.base.history import History, Mesh, peaks_after_failure, unchecked_peak_note
from knittest.laboratory.report_base import REPORTS
from knittest.report_page.loaded_run import load_run
from knittest.report_page.results import results

NO_MESH = Mesh("beams", np.zeros((0, 2), np.int64), np.zeros(0, np.int64), (), np.zeros(0, np.int64), np.zeros(0))


def history(first_failure: int | None) -> History:
    """An eighth of a percent of strain a row of the energies, of which the curve has every other."""
    time = np.arange(21.0)
    curve = {"time_ms": time[::2], "strain_pct": 0.125 * time[::2]}
    return History(NO_MESH, curve, {"time_ms": time}, first_failure=first_failure)


def test_a_peak_beyond_the_first_failure_is_found_where_the_energies_have_it():
    found = peaks_after_failure([history(7)], "strain_pct", [1.3])
    assert found == {"specimens": 1, "first_failure_pct": [0.875], "peak_pct": [1.3]}
    note = unchecked_peak_note(found)
    assert "0.88 %" in note and "1.30 %" in note


@pytest.mark.parametrize(("failure", "peak"), [(None, 1.3), (13, 1.625), (14, 1.3)])
def test_nothing_is_said_of_a_peak_that_is_judged(failure, peak):
    assert peaks_after_failure([history(failure)], "strain_pct", [peak]) is None
    assert unchecked_peak_note(None) == ""
    # strains that two digits do not tell apart are not worth a line
    assert unchecked_peak_note({"specimens": 1, "first_failure_pct": [1.601], "peak_pct": [1.604]}) == ""


def test_of_an_ensemble_those_that_lie_beyond_are_counted():
    found = peaks_after_failure([history(7), history(None), history(9)], "strain_pct", [1.3, 1.2, 1.45])
    assert found == {"specimens": 3, "first_failure_pct": [0.875, 1.125], "peak_pct": [1.3, 1.45]}
    note = unchecked_peak_note(found)
    assert all(text in note for text in ("0.88 to 1.12 %", "1.30 to 1.45 %", "2 of 3 specimens"))


def test_the_page_says_it_beside_the_results(tmp_path):
    path = write_run(tmp_path / "run")
    summary = path / "summary.json"
    beyond = '{"unjudged": {"specimens": 1, "first_failure_pct": [0.85], "peak_pct": [1.32]},'
    texts = [block.text for block in results(load_run(path)).blocks if hasattr(block, "text")]
    assert not any("first failure" in text for text in texts)
    summary.write_text(summary.read_text().replace("{", beyond, 1))
    texts = [block.text for block in results(load_run(path)).blocks if hasattr(block, "text")]
    assert any("0.85 %" in text and "1.32 %" in text for text in texts)


def test_strips_name_the_result_that_says_where_their_peak_lies():
    assert {k: r.axes.peak for k, r in REPORTS.items() if r.axes.peak} == {
        "tensile": "fracture_strain_pct", "biaxial": "biaxial_strain_pct",
    }  # fmt: skip
