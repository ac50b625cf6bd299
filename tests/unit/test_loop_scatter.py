"""Loop length of each course drawn with the measured scatter: off by default, seeded, and led into the draw-in."""

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.fabric.relaxation import relaxed_cell
from knittest.fabric.topology import draw
from knittest.laboratory.base import PreparedSpecimen
from knittest.laboratory.strips import cut_piece
from knittest.models.meso import build_meso
from knittest.runs.deck.deck_file import deck_differences

SCATTERED = "fabric.knitting.loop_scatter=courses"


def run_of(*sets: str, mode: str = "random") -> Run:
    return resolve(
        variant="1", scale="meso", preset="quick", test="picture-frame", sets=[f"variability.mode={mode}", *sets]
    )


def drawn(run: Run, n: int, system: str = "knit", specimen: int = 0):
    return draw(run.fabric, run.variability, system, n, specimen)


def test_courses_scatter_as_measured_about_the_mean():
    """V1: 14.4 ± 0.5 mm, 3.47 %."""
    loop = drawn(run_of(SCATTERED), 20_000).loop
    assert loop.std(ddof=1) == pytest.approx(0.5 / 14.4, rel=0.02) and loop.mean() == pytest.approx(1.0, abs=1e-3)
    few = drawn(run_of(SCATTERED, mode="representative"), 8).loop
    assert few.mean() == pytest.approx(1.0, abs=1e-12) and few.std() > 0.02


def test_same_seed_same_lengths_and_other_draws_keep_their_bits():
    one, again = (drawn(run_of(SCATTERED), 9) for _ in range(2))
    assert np.array_equal(one.loop, again.loop)
    assert not np.array_equal(one.loop, drawn(run_of(SCATTERED), 9, specimen=1).loop)
    assert not np.array_equal(one.loop, drawn(run_of(SCATTERED, "variability.seed=2"), 9).loop)
    off = drawn(run_of(), 9)
    assert off.loop is None
    for name in ("fracture_strain", "slack", "amplitude", "weakest"):
        assert np.array_equal(getattr(off, name), getattr(one, name))


def test_inlays_and_uniform_specimens_have_none():
    assert drawn(run_of(SCATTERED), 5, "warp").loop is None
    assert drawn(run_of(SCATTERED, mode="uniform"), 5).loop is None


def test_a_length_without_a_stated_scatter_is_refused():
    run = run_of(SCATTERED, "fabric.loop_length={value: 14.4, source: measured, ref: here}")
    with pytest.raises(InputError, match=r"loop_scatter = courses: fabric\.loop_length states no sd"):
        drawn(run, 3)


def test_the_fabric_is_settled_and_each_held_course_has_its_own_length_at_rest():
    """A course of loops longer by 2 %, drawn in by 1 %, rests 0.99 x 1.02 as long as it lies; cut edges do not."""
    run = run_of(SCATTERED, "fabric.knitting.loop_shortening=1")
    assert run_of(SCATTERED).fabric.knitting.starts_relaxed and not run_of().fabric.knitting.starts_relaxed
    relaxed_cell(run.fabric)
    piece = cut_piece(run, 4, 5)
    draws = piece.draws | {"knit": piece.draws["knit"].__class__(
        *(getattr(piece.draws["knit"], f) for f in ("fracture_strain", "slack", "amplitude", "weakest")),
        np.array([0.9, 1.02, 0.97, 1.0, 1.1]),
    )}  # fmt: skip
    model = build_meso(run, piece.paths, draws)
    knit = [path for path in piece.paths if path.system == "knit"]
    loop = run.model.meso.elements_per_loop
    found = []
    for path in knit:
        middle = path.points[2 * loop]
        node = int(np.argmin(np.linalg.norm(model.position() - middle, axis=1)))
        length = float(np.linalg.norm(model.position()[node + 1] - model.position()[node]))
        found.append(1.0 / model.beams.inv_length[node] / length)
    assert found == pytest.approx([1.0, 0.99 * 1.02, 0.99 * 0.97, 0.99, 1.0], rel=1e-9)


def test_lengths_of_courses_are_in_the_table_of_yarns_where_they_scatter():
    table = cut_piece(run_of(SCATTERED), 3, 4).table
    knit = table["system"] == "knit"
    assert table["loop_length_relative"][knit].std() > 0.0 and (table["loop_length_relative"][~knit] == 1.0).all()
    assert "loop_length_relative" not in cut_piece(run_of(), 3, 4).table


def test_a_deck_says_that_it_leaves_the_scatter_out():
    run = run_of(SCATTERED)
    piece = cut_piece(run, 3, 4)
    model = build_meso(run, piece.paths, piece.draws)
    told = "\n".join(deck_differences(run, PreparedSpecimen(model, mount=None)))  # type: ignore[arg-type]
    assert "scatter of the loop length" in told
    plain = build_meso(run_of(), cut_piece(run_of(), 3, 4).paths, cut_piece(run_of(), 3, 4).draws)
    assert "scatter of the loop" not in "\n".join(deck_differences(run_of(), PreparedSpecimen(plain, mount=None)))  # type: ignore[arg-type]
