"""Gates on made-up histories: what refuses a comparison, what is only named, and what nobody can talk out of it."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from export_sample import shell_history

from knittest.base.errors import InputError
from knittest.base.history import History, Overlaps, Quality, checked_rows
from knittest.base.kinds import kinds
from knittest.config.loading import resolve
from knittest.config.quality_checks import check_relaxed_limits, quality_checks_of, relaxed_limits
from knittest.config.run import Run
from knittest.config.yaml_writer import dump
from knittest.laboratory.quality_checks import Span, assess, loss_ratios
from knittest.laboratory.shear_law_end import MARGIN, law_excess, shell_areas
from knittest.report_page.quality_checks import _largest_force
from knittest.runs.run_files import _worst_quality
from knittest.solve.state import SimulationCost

ROWS = 101
PREPARED: Any = SimpleNamespace(
    model=SimpleNamespace(added_mass=0.0, chunk=20, compliant=False),
    duration=100.0,
    rig=SimpleNamespace(relaxed_rows=0),
)


def run_of(test: str = "friction", *sets: str, **more: Any) -> Run:
    chosen = {"variant": "1", "scale": "macro", "preset": "quick"} | more
    return resolve(test=test, direction="warp" if kinds()[test].directional else None, sets=sets, **chosen)


def history(**columns: Any) -> History:
    """Work that grows evenly to 1000 mJ in 100 ms, half of it held; ``columns`` instead of a good run's."""
    time = np.linspace(0.0, 100.0, ROWS)
    work, zero = 10.0 * time, np.zeros(ROWS)
    table = {
        "time_ms": time, "external_mj": work, "internal_fabric_mj": 0.5 * work, "damping_mj": zero,
        "contact_damping_mj": zero, "hourglass_mj": zero, "kinetic_ratio": zero, "energy_error": zero,
    } | columns  # fmt: skip
    curve = {"time_ms": time, "force_n": np.append(time[:91], np.zeros(10)), "frame_shear_angle_deg": 0.45 * time}
    # a pull that is largest at 4 mm, before half of its way
    curve |= {"displacement_mm": 0.1 * time, "pull_force_n": 300.0 - np.abs(time - 40.0)}
    return History(shell_history().mesh, curve, table, [replace(f, fields={}) for f in shell_history().frames])


def judged(found: History, run: Run | None = None, span: Span | None = None, **more: Any) -> Quality:
    return assess(run or run_of(), PREPARED, found, SimulationCost(time_step=1e-4), span or Span(), **more)


def at(row: int, value: float) -> np.ndarray:
    """Nothing but ``value`` in one row."""
    column = np.zeros(ROWS)
    column[row] = value
    return column


def test_a_good_run_passes_without_a_word() -> None:
    quality = judged(history())
    assert (quality.failures, quality.warnings, quality.quasi_static) == ((), (), True)


@pytest.mark.parametrize(
    ("column", "whole", "key", "label"),
    [
        ("damping_mj", "external_mj", "damping_over_work_max", "damping energy over work"),
        ("contact_damping_mj", "external_mj", "contact_damping_over_work_max", "contact damping over work"),
        ("hourglass_mj", "internal_fabric_mj", "hourglass_over_internal_max", "hourglass energy over internal energy"),
    ],
)
@pytest.mark.parametrize("test", ["tensile", "friction", "picture-frame", "forming", "bias-extension", "biaxial"])
def test_each_loss_above_a_twentieth_refuses_in_every_test(
    test: str, column: str, whole: str, key: str, label: str
) -> None:
    run = run_of(test)
    for share, verdict in ((0.024, "passed"), (0.026, "warned"), (0.049, "warned"), (0.051, "refused")):
        quality = judged(history(**{column: share * history().energies[whole]}), run)
        assert getattr(quality, key) == pytest.approx(share)
        said = {"refused": quality.failures, "warned": quality.warnings, "passed": ()}[verdict]
        assert len(quality.failures) + len(quality.warnings) == len(said), (share, quality)
        assert all(text.startswith(f"{label} {100 * share:.2f} %") for text in said)


def test_a_loss_counts_where_it_is_largest_and_not_at_the_end_only() -> None:
    """30 mJ from half way on: 6 % of the work there, 3 % at the end."""
    found = history(damping_mj=np.where(np.arange(ROWS) >= 50, 30.0, 0.0))
    assert judged(found).damping_over_work_max == pytest.approx(0.06)
    assert judged(found).failures


def test_energy_given_to_contacts_found_late_counts_with_their_damping() -> None:
    work = history().energies["external_mj"]
    found = history(contact_damping_mj=0.02 * work, contact_recovery_mj=0.04 * work)
    assert judged(found).contact_damping_over_work_max == pytest.approx(0.06) and judged(found).failures


def test_losses_of_nothing() -> None:
    shares = loss_ratios(history(hourglass_mj=at(0, 1.0)).energies)
    assert shares[0][0] == 0.0 and shares[2][0] == np.inf, "hourglass energy without any other is no small share"
    turned = history(external_mj=-history().energies["external_mj"], damping_mj=at(50, 40.0)).energies
    assert loss_ratios(turned)[0][50] == pytest.approx(0.08), "work that is given back counts by its size"
    work = 1000.0 - np.abs(1000.0 - 20.0 * np.arange(ROWS))  # there and back, as in a frame that turns
    back = loss_ratios(history(external_mj=work, internal_fabric_mj=work, damping_mj=np.full(ROWS, 40.0)).energies)
    assert back[0][90] == pytest.approx(0.04) and not np.isinf(back[2]).any()


@pytest.mark.parametrize(
    "column", ["kinetic_ratio", "energy_error", "damping_mj", "contact_damping_mj", "hourglass_mj"]
)
def test_what_is_not_a_number_fails(column: str) -> None:
    quality = judged(history(**{column: at(60, np.nan)}))
    assert len(quality.failures) == 1 and "is not a number" in quality.failures[0]
    assert column != "kinetic_ratio" or not quality.quasi_static


def test_overlaps_penetration_and_mass_that_are_no_numbers_fail() -> None:
    model: Any = SimpleNamespace(model=SimpleNamespace(added_mass=np.nan, compliant=False))
    found = replace(history(), overlaps=Overlaps(1, np.nan))
    quality = assess(run_of(), model, found, SimulationCost(penetration_max=np.nan), Span())
    assert len(quality.failures) == 3


def test_the_worst_specimen_is_the_one_without_a_number() -> None:
    good, bad = judged(history()), judged(history(kinetic_ratio=at(60, np.nan)))
    for order in ([good, bad], [bad, good]):
        assert np.isnan(_worst_quality(order).ke_over_ie_max)
    lossy = replace(good, damping_over_work_max=0.04, drag_over_weight=0.3, beyond_law=0.02)
    assert _worst_quality([good, lossy]) == lossy


def test_a_test_that_goes_on_after_a_failure_is_judged_to_its_end() -> None:
    """A shell that breaks early in forming must not end the judgement."""
    found = replace(history(kinetic_ratio=at(80, 0.5)), first_failure=40)
    assert judged(found).failures and not judged(found, run_of("tensile"), Span(to_failure=True)).failures
    deep = replace(found, contacts={"penetration_max_pct": at(80, 40.0)}, energies=history().energies)
    assert judged(deep).penetration_over_radius_max == pytest.approx(0.4)
    assert judged(deep, run_of("tensile"), Span(to_failure=True)).penetration_over_radius_max == 0.0


SETTLED = "fabric.knitting.loop_shortening=1"
ELLIPSES = (
    "fabric.reinforcing.section={shape: ellipse, fibre_density: 1.53, packing: {warp: 0.9, weft: 0.9}, "
    "width_to_height: {warp: 1.5, weft: 1.5}}"
)


@pytest.mark.parametrize("where", ["force_free_overlap_max_pct", "force_free_at_ends_max_pct"])
@pytest.mark.parametrize("given", ["", SETTLED, ELLIPSES])
@pytest.mark.parametrize(("share", "refused"), [(9.0, 0), (11.0, 1)])
def test_overlap_without_force_refuses_every_run_of_yarns(share: float, given: str, refused: int, where: str) -> None:
    """Away from the ends of yarns and at them, whether the yarns start settled or not.

    An overlap that lasts for one row does not.
    """
    run = run_of("friction", *([given] if given else []), scale="meso")
    found = replace(history(), contacts={where: at(60, share) + at(61, share) + at(80, 50.0)})
    quality = judged(found, run)
    assert quality.force_free_overlap_max == pytest.approx(0.01 * share)
    assert len(quality.failures) == refused and all(
        text.startswith("force-free yarn overlap") for text in quality.failures
    )
    assert judged(found, run_of()).failures == ()


@pytest.mark.parametrize(("share", "warned"), [(99.0, False), (101.0, True)])
def test_a_contact_found_beyond_the_other_centre_line_warns(share: float, warned: bool) -> None:
    found = replace(history(), contacts={"found_late_max_pct": at(60, share)})
    quality = judged(found, run_of("friction", scale="meso"))
    assert not quality.failures
    assert any("found late" in text for text in quality.warnings) == warned


def test_rows_from_the_first_number_that_is_reported() -> None:
    """A frame that shears on to large angles must not push the force at 10 deg into its start-up."""
    work = np.arange(float(ROWS)) ** 4
    found = history(external_mj=work, kinetic_ratio=at(22, 0.5))
    assert checked_rows(found).start == 48 and not judged(found).failures
    assert checked_rows(found, to_failure=False, reported_from=21.1).start == 22
    assert judged(found, span=Span(reported_from=21.1)).failures
    assert checked_rows(found, reported_from=90.0).start == 48, "it never shortens what is judged"


def test_the_span_of_the_frame_begins_at_its_first_angle() -> None:
    from knittest.laboratory.report_base import TESTS

    span = TESTS["picture-frame"].span(history())
    assert not span.to_failure and span.reported_from == pytest.approx(22.0)  # 9.5 deg are passed at 21.1 ms
    assert TESTS["tensile"].span(history()).to_failure
    assert not any(TESTS[test].span(history()).to_failure for test in ("friction", "forming"))


def test_the_span_of_friction_holds_the_samples_of_its_static_force() -> None:
    """Work that comes late would leave them out; energies before them are those of the start."""
    from knittest.laboratory.friction.test import Friction, static_force

    late = history(external_mj=np.append(np.zeros(60), np.linspace(0.0, 1000.0, ROWS - 60)))
    force, since = static_force(late.curve)
    assert force == pytest.approx(300.0 - 1.2) and since == pytest.approx(38.0)  # mean of 298, 299, 300, 299, 298
    span = Friction().span(late)
    assert span.rows(late).start == 38 < checked_rows(late, to_failure=False).start
    for row, passes in ((37, True), (39, False)):
        found = replace(late, energies=late.energies | {"kinetic_ratio": at(row, 0.5)})
        assert judged(found, span=span).quasi_static == passes
    still = static_force({name: np.zeros(5) for name in ("displacement_mm", "pull_force_n", "time_ms")})
    assert np.isnan(still[0]) and still[1] == np.inf


def test_too_few_rows_and_a_failure_long_before_the_peak_refuse() -> None:
    few = history(external_mj=np.append(np.zeros(ROWS - 5), np.arange(1.0, 6.0)))
    (reason,) = judged(few, run_of("friction", "output.samples=100")).failures
    assert reason.startswith("5 samples lie between") and "--set output.samples=300" in reason
    run, span = run_of("tensile"), Span(to_failure=True)
    assert not judged(replace(history(), first_failure=24), run, span).failures
    (reason,) = judged(replace(history(), first_failure=22), run, span).failures  # 210 of the 900 mJ at the peak
    assert reason.startswith("the first failure comes at 23 % of the work up to the peak force")
    (reason,) = judged(history(), run, span).failures
    assert reason == "nothing failed up to rig.max_strain, so the peak force is no strength: raise rig.max_strain"


def test_forming_that_drags_more_than_a_tenth_of_the_weight_is_refused_with_settings() -> None:
    run = run_of("forming", "solver.damping=0.05", "solver.speed=0.2")
    assert not judged(history(), run, drag=0.0999).failures
    (reason,) = judged(history(), run, drag=0.4).failures
    assert "damping force over weight and blank-holder force 40.00 % is above 10 %" in reason
    assert "preset quick passes with --set solver.damping=0.006 --set solver.speed=0.05" in reason
    assert not judged(history(), run_of("forming"), drag=0.0999).failures
    assert [gate.key for gate in quality_checks_of(run_of())].count("drag_over_weight") == 0


ANGLE, AREA = np.array([10.0, 20.0, 50.0, 60.0]), np.array([45.0, 52.0, 2.0, 1.0])


def test_shear_beyond_the_law_by_area_with_what_a_law_needs() -> None:
    found = law_excess(ANGLE, AREA, 48.7)
    assert (found.share, found.end, found.largest, found.needed) == (pytest.approx(0.03), 48.7, 60.0, 20.0)
    assert law_excess(ANGLE, AREA, 50.0 - 0.99 * MARGIN).share == pytest.approx(0.01), "a frame scatters about its end"
    assert law_excess(ANGLE, AREA, 5.0).needed == 20.0
    assert "3.0 % of the fabric is sheared beyond the end of its shear law, 48.7 deg, up to 60 deg" in found.stated
    squares = np.array([[[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0]], [[0, 0, 0], [0, 1, 0], [0, 1, 1], [0, 0, 1]]])
    assert shell_areas(squares.astype(float)) == pytest.approx([6.0, 1.0])


@pytest.mark.parametrize(("share", "failures", "warnings"), [(0.0, 0, 0), (0.025, 0, 1), (0.1, 1, 0)])
def test_shear_beyond_the_law_is_named_and_beyond_a_twentieth_refused(
    share: float, failures: int, warnings: int
) -> None:
    n = 40
    frame = shell_history().frames[0]
    angle = np.where(np.arange(n) < share * n, -60.0, 30.0)
    found = replace(history(), frames=[replace(frame, fields={"alive": np.ones(n), "shear_angle": np.deg2rad(angle)})])
    quality = judged(found, run_of("forming"))
    assert quality.beyond_law == pytest.approx(share)
    assert (len(quality.failures), len(quality.warnings)) == (failures, warnings)


LOOSE = {
    "solver.max_kinetic_ratio": 100, "solver.max_energy_error": 2.1, "solver.max_penetration": 26,
    "solver.max_overlap": 11, "solver.max_force_free_overlap": 11,
    "solver.max_added_mass": 6, "solver.max_damping": 5.1,
    "solver.max_contact_damping": 50, "solver.max_hourglass": 90,
    "solver.max_law_extrapolation": 6, "solver.max_damping_force": 11,
    "rig.membrane_share": 0.01, "model.macro.self_contact": False,
}  # fmt: skip


@pytest.mark.parametrize("name", LOOSE)
def test_a_limit_looser_than_the_presets_refuses_until_it_is_accepted(name: str, tmp_path: Any) -> None:
    text = f"{name}={str(LOOSE[name]).lower()}"
    run = run_of("forming", text)
    assert [one.name for one in relaxed_limits(run)] == [name]
    quality = check_relaxed_limits(run, judged(history(), run))
    assert len(quality.failures) == 1 and "accept it with --accept-limits" in quality.failures[0]
    accepted = run_of("forming", text, accept_limits=True)
    quality = check_relaxed_limits(accepted, judged(history(), accepted))
    assert not quality.failures and "accepted by --accept-limits" in quality.warnings[-1]
    kept = tmp_path / "config.yaml"  # of a run folder: it carries the limit, and not that it was accepted
    kept.write_text(dump(accepted))
    again = resolve(config=kept)
    assert [one.name for one in relaxed_limits(again)] == [name] and not again.accept_limits
    assert resolve(config=kept, accept_limits=None) == accepted


@pytest.mark.parametrize(
    ("test", "sets"),
    [
        ("tensile", "rig.stop_force_ratio=0.9"),
        ("cantilever", "rig.tolerance=0.01"),
        ("cantilever", "rig.membrane_share=0.001"),
    ],
)
def test_what_a_gate_hangs_on_counts_as_a_limit(test: str, sets: str) -> None:
    assert [one.name for one in relaxed_limits(run_of(test, sets))] == [sets.partition("=")[0]]


@pytest.mark.parametrize("field", ["contact", "knitting"])
def test_contact_or_loops_that_are_left_out_count_at_their_scale_only(field: str) -> None:
    off = f"model.meso.{field}=false"
    assert [one.text for one in relaxed_limits(run_of("tensile", off, scale="meso"))] == [
        f"model.meso.{field} = false, looser than the preset's true"
    ]
    assert relaxed_limits(run_of("tensile", off)) == []


def test_stricter_limits_and_all_presets_are_no_looser() -> None:
    assert not relaxed_limits(
        run_of("forming", "solver.max_kinetic_ratio=1", "solver.max_damping_force=9.9", "rig.membrane_share=0.06")
    )
    for test in ("tensile", "picture-frame", "cantilever", "friction", "forming"):
        for scale in ("macro", "meso"):
            for preset in ("quick", "standard", "paper"):
                assert not relaxed_limits(run_of(test, scale=scale, preset=preset))


def test_no_setting_and_no_config_accepts_limits(tmp_path: Any) -> None:
    with pytest.raises(InputError, match="accept_limits cannot be set: use --accept-limits instead"):
        run_of("tensile", "accept_limits=true")
    path = tmp_path / "rig.yaml"
    path.write_text("accept_limits: true\nsolver: {max_kinetic_ratio: 50}\n")
    run = resolve(config=path, variant="1", scale="macro", direction="warp")
    assert not run.accept_limits and check_relaxed_limits(run, judged(history(), run)).failures


def test_energies_at_the_largest_force_are_of_the_row_before_the_break():
    """The largest force falls between two rows, nearer to the second, in which the strip is torn."""
    axes = SimpleNamespace(y="force_n")
    curve = {"time_ms": np.array([0.0, 0.9, 1.0]), "force_n": np.array([0.0, 90.0, 5.0])}
    times = {"time_ms": np.array([0.0, 0.5, 1.0])}
    run: Any = SimpleNamespace(curve=curve, report=SimpleNamespace(axes=axes), energies=times)
    assert _largest_force(run) == 1
