"""Every picture says which run it is of, by which version, when, and whether it may be compared."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from knittest import __version__
from knittest.base.figure import BAD, DPI, FACTS, LETTER, MARGIN, Stamp, new_figure, save, stamp_lines, use_stamp
from knittest.config.loading import resolve
from knittest.laboratory.report_base import run_stamp, size_of

SIZES = {
    "tensile": (["rig.width=40", "rig.gauge_length=120"], ["40 mm wide", "120 mm between"]),
    "picture-frame": (["rig.side=100", "rig.frame_side=150"], ["square of 100 mm", "frame of 150 mm"]),
    "cantilever": (["rig.width=30"], ["30 mm wide"]),
    "friction": (["rig.normal_force=1500"], ["plates 150 x 50 mm", "1500 N"]),
    "forming": (
        ["rig.blank_holder_force=100", "rig.blank_width=300", "rig.blank_length=290", "rig.depth=15"],
        ["blank 300 x 290 mm", "holder 100 N", "stamp t, 15 mm"],
    ),
}


@pytest.mark.parametrize("kind", list(SIZES))
@pytest.mark.parametrize("scale", ["macro", "meso"])
def test_a_stamp_names_fabric_test_scale_preset_and_size(kind: str, scale: str) -> None:
    sets, words = SIZES[kind]
    run = resolve(test=kind, variant="2", scale=scale, preset="quick", sets=sets)
    told = " · ".join(run_stamp(run, ()).facts)
    for word in ("pham2019-v2", "calibrated", kind, scale, "preset quick", *words):
        assert word in told
    assert run.direction in told


def test_the_verdict_says_refused_and_why() -> None:
    run = resolve(test="tensile", variant="1", scale="macro")
    assert (run_stamp(run, ()).verdict, run_stamp(run, ()).bad) == ("quality checks passed", False)
    refused = run_stamp(run, ("kinetic energy 9 %", "energy error 3 %"))
    assert refused.verdict == "rejected: kinetic energy 9 %; energy error 3 %" and refused.bad


def test_accepted_limits_and_another_fabrics_curves_are_marked() -> None:
    sets = ["solver.max_kinetic_ratio=50"]
    run = resolve(test="tensile", variant="1", scale="macro", sets=sets, accept_limits=True)
    assert "relaxed limits: solver.max_kinetic_ratio = 50 %" in run_stamp(run, ()).verdict and run_stamp(run, ()).bad
    own = resolve(test="picture-frame", variant="1", scale="macro")
    other = own.model_copy(update={"fabric": own.fabric.model_copy(update={"name": "mine"})})
    assert "assumed: macro.shear of pham2019-v1" in run_stamp(other, ()).verdict
    assert "assumed" not in run_stamp(own, ()).verdict
    assert "no holder" in size_of(resolve(test="forming", variant="1"))


def test_version_and_date_stand_below_every_picture_and_a_refusal_is_red() -> None:
    ((text, colour),) = stamp_lines(Stamp(), 8.0)
    assert text.startswith(f"knittest {__version__} · 20") and colour == FACTS
    *_, last = stamp_lines(Stamp(("a",), "comparison refused: x", bad=True), 8.0)
    assert last == ("comparison refused: x", BAD)


def test_a_line_breaks_between_facts() -> None:
    facts = [f"fact number {k}" for k in range(20)]
    lines = [text for text, _ in stamp_lines(Stamp(facts), 4.0)]
    assert len(lines) > 3 and not [line for line in lines if line.startswith("·") or line.endswith("·")]
    assert [fact for line in lines for fact in line.split(" · ")][:20] == facts


@pytest.mark.parametrize("width", [5.2, 8.0, 15.0])
def test_no_line_is_wider_than_the_picture(width: float) -> None:
    failures = [f"kinetic energy over work {k}.{k}{k} % is above {k} %: WIDE CAPITALS MMMM" for k in range(1, 9)]
    run = resolve(test="forming", variant="1", sets=["rig.blank_holder_force=100"])
    lines = stamp_lines(run_stamp(run, failures), width)
    assert len(lines) > 2
    figure = new_figure(width, 1.0)
    for line, _ in lines:
        box = figure.text(MARGIN / width, 0.5, line, fontsize=LETTER).get_window_extent()
        assert box.x1 < figure.bbox.x1, line


def test_the_stamp_lies_below_the_picture_and_covers_none_of_it(tmp_path: Path) -> None:
    def drawn(stamp: Stamp) -> np.ndarray:
        figure = new_figure(4.0, 2.0)
        figure.patch.set_facecolor("#00ff00")
        with use_stamp(stamp):
            save(figure, tmp_path / "x.png")
        return imread(tmp_path / "x.png")

    plain, long = drawn(Stamp()), drawn(Stamp(("fabric",) * 40, "comparison refused", bad=True))
    for pixels in (plain, long):
        assert (pixels[: 2 * DPI, :, :3] == [0.0, 1.0, 0.0]).all()
        assert pixels.shape[0] > 2 * DPI and pixels.shape[1] == 4 * DPI
        strip = pixels[2 * DPI :, :, :3].mean(axis=2)
        assert (strip < 0.6).any()
        assert (strip[:6] == 1.0).all() and (strip[-4:] == 1.0).all()  # no letter is cut
    assert long.shape[0] > plain.shape[0]


def test_lines_are_evenly_long_so_that_none_holds_the_date_alone() -> None:
    lines = [text for text, _ in stamp_lines(Stamp(("square of 50 mm", "preset quick", "seed 1")), 4.0)]
    assert len(lines) == 2 and min(map(len, lines)) > 0.6 * max(map(len, lines))
