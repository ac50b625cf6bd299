"""Records of trials: results as numbers, and what a ledger keeps of them."""

import math

import pytest

from knittest.studies.trials.record import Record

SUMMARY = {
    "results": {
        "peak_n": 5.0,
        "onset_deg": None,
        "force_n_at_deg": {"10": 1.0},
        "strain": {"mean": 2.0, "values": [2.0]},
    },
    "cost": {"cpu_s": 3.0},
}


def test_a_result_that_json_cannot_hold_is_no_number_and_no_zero() -> None:
    found = Record("k", "completed", summary=SUMMARY).results  # type: ignore[arg-type]
    assert math.isnan(found.pop("onset_deg"))
    assert found == {"peak_n": 5.0, "force_n_at_deg.10": 1.0, "strain": 2.0}


@pytest.mark.parametrize("status", ["failed", "refused"])
def test_only_a_completed_trial_has_results(status: str) -> None:
    record = Record("k", status, summary=SUMMARY)  # type: ignore[arg-type]
    assert record.results == {} and record.cost == {"cpu_s": 3.0}


@pytest.mark.parametrize("summary", [None, SUMMARY])
def test_a_ledger_keeps_a_record_and_an_empty_map_where_there_is_no_result(summary: object) -> None:
    record = Record("k", "completed" if summary else "timeout", "why", summary, earlier=("lost",))  # type: ignore[arg-type]
    kept = record.to_dict()
    assert kept["summary"] == (summary or {}) and Record.from_dict(kept) == record
    assert record.cost == (SUMMARY["cost"] if summary else None) and record.looser_limits == []
