"""Ways in which drift would be green and wrong: a baseline or a run that lacks something, crests, curves cut short."""

import json
from math import nan
from pathlib import Path

import numpy as np
import pytest

from docs import provenance
from knittest.base.errors import InputError
from knittest.studies.regress import cases
from knittest.studies.regress.baseline import Curve, Entry, entry_of, load
from knittest.studies.regress.cases import Case
from knittest.studies.regress.drift import Drift, drift_of
from knittest.studies.regress.outcome import Outcome
from knittest.studies.trials.trial import Record

FRAME = Case("picture-frame", "macro", "1", None, "quick", enlarges=True)
RUN = FRAME.trial().run
NAME, COUNT = "shear_force_n_at_deg.30", "wrinkle_count_at_40deg"
X, Y = "frame_shear_angle_deg", "shear_force_n"
ALONG = np.linspace(0.0, 40.0, 41)


def run_in(folder: Path, numbers, y=ALONG / 2.0, x=ALONG) -> tuple[Record, Path]:
    """A completed frame with ``numbers`` and a curve, by default of half a newton a degree."""
    folder.mkdir(exist_ok=True)
    np.savetxt(folder / "curve.csv", np.column_stack([x, y]), delimiter=",", header=f"{X},{Y}", comments="")
    return Record("k", "completed", summary={"results": numbers, "cost": {"elements": 4}}), folder


def stored(tmp_path, numbers, **more) -> Entry:
    """The entry of a run with ``numbers``."""
    return entry_of(RUN, *run_in(tmp_path / "stored", numbers)).model_copy(update=more)


def reasons(tmp_path, entry, numbers, **curve):
    """Reasons for which a run with ``numbers`` fails beside ``entry``."""
    return drift_of(FRAME, RUN, *run_in(tmp_path / "now", numbers, **curve), entry).reasons


@pytest.mark.parametrize(("now", "passes"), [(0, False), (1, True), (2, True), (4, True), (5, False), (nan, False)])
def test_crests_pass_from_one_below_the_least_to_one_above_the_greatest(tmp_path, now, passes):
    """Twelve runs with 2 or 3."""
    entry = stored(tmp_path, {COUNT: 2.5, NAME: 1.0}, runs=12, ranges={COUNT: (2, 3)})
    found = reasons(tmp_path, entry, {COUNT: float(now), NAME: 1.0})
    assert (found == []) == passes
    assert passes or COUNT in found[0]


def test_a_run_without_room_hides_no_drift_of_another(tmp_path):
    """4 tells a CI to try again: only where nothing else is wrong."""
    blocked = Drift(FRAME, None, problem="no room", is_blocked=True)
    drifted = drift_of(FRAME, RUN, *run_in(tmp_path / "now", {NAME: 2.0}), stored(tmp_path, {NAME: 1.0}))

    def code(*drifts: Drift, lost: tuple[str, ...] = ()) -> int:
        return Outcome("quick", {}, (), (), drifts, tmp_path, lost=lost).exit_code

    assert [code(blocked), code(drifted), code(blocked, drifted), code(blocked, lost=("gone",))] == [4, 5, 5, 5]


def test_crests_of_one_run_or_of_a_mean_alone_have_no_wider_range_than_is_known(tmp_path):
    assert reasons(tmp_path, stored(tmp_path, {COUNT: 2.0}), {COUNT: 3.0}) == []
    assert reasons(tmp_path, stored(tmp_path, {COUNT: 2.0}), {COUNT: 4.0}) != []
    old = stored(tmp_path, {COUNT: 2.5}, runs=12, scatter={COUNT: 0.52})
    assert reasons(tmp_path, old, {COUNT: 4.0}) == [] and reasons(tmp_path, old, {COUNT: 5.0}) != []


@pytest.mark.parametrize("value", [nan, None, float("inf")])
def test_a_number_that_lost_or_found_its_value_fails(tmp_path, value):
    """One without a value on both sides is as it was; one that only some runs have is not judged."""
    both, one = {NAME: 1.0, "onset": 12.0}, {NAME: 1.0, "onset": value}
    assert any("onset: 12 stored" in text for text in reasons(tmp_path, stored(tmp_path, both), one))
    found = reasons(tmp_path, stored(tmp_path, one), both)
    assert found == ["onset: 12 now, no value in the baseline"]
    assert reasons(tmp_path, stored(tmp_path, one), one) == []
    assert "without a number" in reasons(tmp_path, stored(tmp_path, {NAME: 1.0}), {NAME: nan})[0]
    assert reasons(tmp_path, stored(tmp_path, both, elements=5), both)[0].startswith("elements: 5 stored, 4 now")
    assert reasons(tmp_path, stored(tmp_path, one, sometimes=["onset"]), both) == []


@pytest.mark.parametrize(
    ("x", "y", "said"),
    [
        (ALONG[:35], np.minimum(ALONG, 34.0)[:35] / 2.0, f"curve, end in {X}: 40 stored, 34 now"),
        (ALONG[5:], ALONG[5:] / 2.0, f"curve, end in {X}: 0 stored, 5 now"),
        (ALONG, np.where(ALONG == 21.0, nan, ALONG / 2.0), "not finite"),
        (np.where(ALONG == 21.0, nan, ALONG), ALONG / 2.0, "not finite"),
        (ALONG[:1], ALONG[:1] + 1.0, "no length"),
        (ALONG, 0.0 * ALONG, "no height"),
    ],
)
def test_a_curve_cut_short_or_with_holes_fails(tmp_path, x, y, said):
    """With a stored curve that is flat where the other ends, so that its last value, held on, would pass."""
    entry = stored(tmp_path, {NAME: 1.0})
    assert entry.curve is not None
    flat = np.minimum(np.array(entry.curve.x), 34.0) / 2.0
    entry = entry.model_copy(update={"curve": entry.curve.model_copy(update={"y": flat.tolist()})})
    assert said in " ".join(reasons(tmp_path, entry, {NAME: 1.0}, x=x, y=y))


def test_a_baseline_without_the_curve_or_with_one_of_something_else_fails(tmp_path):
    entry = stored(tmp_path, {NAME: 1.0})
    assert entry.curve is not None
    (text,) = reasons(tmp_path, entry.model_copy(update={"curve": None}), {NAME: 1.0})
    assert text == "the baseline has no curve of this run"
    other = entry.curve.model_copy(update={"y_name": "pull_n"})
    (text,) = reasons(tmp_path, entry.model_copy(update={"curve": other}), {NAME: 1.0})
    assert text == f"the baseline has a curve of pull_n over {X}, the test of {Y} over {X}"


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("scatter", NAME), nan, f"scatter.{NAME}: Input should be a finite number"),
        (("scatter", "other"), 1.0, "scatter, ranges: expected one for each number in results: other"),
        (("runs",), 1, "scatter, ranges: expected none of 1 run"),
        (("curve", "scatter"), [0.0], "curve: scatter has 1 values, y 3"),
        (("curve", "y"), [0.0, 1.0], "curve: y has 2 values, x 3"),
        (("curve", "y"), [0.0, 0.0, 0.0], "curve: y: expected values other than 0"),
        (("curve", "x"), [0.0, 2.0, 1.0], "curve: x: expected values that grow"),
        (("results",), {}, "results: Dictionary should have at least 1 item"),
        (("ranges", COUNT), [3, 4], f"ranges.{COUNT}: 3 to 4 does not contain the mean 2.5"),
    ],
)
def test_a_baseline_with_a_wrong_field_is_refused_by_file_run_and_field(tmp_path, path, value, said):
    curve = Curve(x_name=X, y_name=Y, x=[0.0, 1.0, 2.0], y=[0.0, 1.0, 2.0], scatter=[0.0, 0.1, 0.1])
    good = Entry(
        commit=None, date="", cpu="", elements=4, results={NAME: 1.0, COUNT: 2.5}, runs=12, scatter={NAME: 0.1},
        ranges={COUNT: (2, 3)}, curve=curve,
    )  # fmt: skip
    data = {"format": 1, "entries": {"frame": good.model_dump(mode="json")}}
    file = tmp_path / "b.json"
    file.write_text(json.dumps(data))
    assert load(file).entries["frame"] == good
    holder = data["entries"]["frame"]
    for key in path[:-1]:
        holder = holder[key]
    holder[path[-1]] = value
    file.write_text(json.dumps(data))
    with pytest.raises(InputError) as caught:
        load(file)
    text = str(caught.value)
    assert text.startswith(f"{file}: no baseline of this version: entries.frame") and said in text


def test_libraries_and_processor_make_runs_new(monkeypatch):
    """Finished runs of a folder are not judged again for libraries that they did not run with."""
    keys = {FRAME.trial().key}
    monkeypatch.setattr(cases, "cpu_model", lambda: "another")
    keys.add(FRAME.trial().key)
    monkeypatch.setattr(cases, "library_versions", lambda: {"numpy": "0"})
    keys.add(FRAME.trial().key)
    assert len(keys) == 3


def test_a_number_of_crests_moves_no_table_of_the_docs_within_its_range():
    entry = load(provenance.baseline.shipped_path()).entries[FRAME.name].model_copy(update={"ranges": {COUNT: (2, 3)}})
    assert [provenance._moved(FRAME, COUNT, was, entry) for was in (0.0, 1.0, 2.5, 4.0, 5.0)] == [
        True, False, False, False, True,
    ]  # fmt: skip
