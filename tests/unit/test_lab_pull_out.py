"""Import of pull-outs: inlays held by equal crossings, in closed form, and files that leave open what they mean."""

import re
from dataclasses import replace

import numpy as np
import pytest
from pull_out_files import CROSSINGS, DENSITY, FRICTION, LENGTH, PITCH, STRETCH, export, found, pull
from strip_reading import refused

from knittest.laboratory.pull_out.lab_files import LAB, UNITS

SLACK = 1.5


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_equal_crossings_give_their_friction_back(tmp_path, noise):
    """F = mu N (length / pitch), falling with it: 5 whole pitches of 19.8 mm, the last ones, hold 30.2 to 48.06 mm."""
    one = found(pull(export(tmp_path / "a.csv", noise=noise)))
    middle = LENGTH - 19.8 + 0.5 * 5 * PITCH
    assert one["crossing_friction_n"] == pytest.approx([FRICTION], rel=1e-3 + 0.1 * noise)
    assert one["pull_out_sliding_n"] == pytest.approx([FRICTION * middle / PITCH], rel=1e-3 + 0.1 * noise)
    assert one["pull_out_at_rest_n"] == pytest.approx([FRICTION * CROSSINGS], rel=3e-3 + noise)
    assert one["crossing_friction_at_rest_n"] == pytest.approx([FRICTION], rel=3e-3 + noise)
    assert one["pull_out_peak_n"] == pytest.approx([FRICTION * CROSSINGS], rel=3e-3 + 1.5 * noise)


def test_the_largest_force_is_that_up_to_half_a_pitch(tmp_path):
    """A wavy inlay whose crests lie in the troughs of its channel after half a pitch: four times the force."""
    one = found(pull(export(tmp_path / "a.csv", wave=3.0)))
    assert one["pull_out_peak_n"] == pytest.approx([4.0 * FRICTION * (LENGTH - 0.5 * PITCH) / PITCH], rel=0.01)
    assert one["pull_out_at_rest_n"] == pytest.approx([FRICTION * CROSSINGS], rel=0.02)
    assert one["crossing_friction_n"] == pytest.approx([2.5 * FRICTION], rel=0.01)


@pytest.mark.parametrize("step", [0.001, 0.01, 0.035])
def test_a_force_that_rises_steeply_is_read_where_the_inlay_lets_go(tmp_path, step):
    """As in yarns, from nothing to 0.3 N at 0.05 mm and on to 1.6 N within half a pitch: no mean over rows about it."""
    tail = np.arange(0.0, 6.0, step)
    force = 0.3 * np.sqrt(np.minimum(tail, 1.5) / 0.05)
    text = "".join(f"{t + 0.1:.5f};{t:.5f};{f:.6f}\n" for t, f in zip(tail, force, strict=True))
    (tmp_path / "a.csv").write_text(f"travel [mm];free end [mm];force [N]\n{text}")
    assert found(pull(tmp_path / "a.csv"))["pull_out_at_rest_n"] == pytest.approx([0.3], rel=0.025)
    (tmp_path / "b.csv").write_text(re.sub(r"(?m);[^;]*;", ";", (tmp_path / "a.csv").read_text()))
    alone = pull(tmp_path / "b.csv", zero=0.1)
    assert set(UNITS) - set(found(alone)) == {"pull_out_at_rest_n", "crossing_friction_at_rest_n"}
    told = r"no force at rest: it changes by (19|2\d) % with 0\.02 mm of --zero \(limit 10 %\): measure"
    assert any(re.match(told, line) for line in LAB.lines([alone]))


@pytest.mark.parametrize(
    ("head", "factors"),
    [
        ("travel [cm];free end [um];force [cN]", (0.1, 1000.0, 100.0)),
        ("crosshead [m];tail [mm];load [mN]", (1e-3, -1.0, 1e3)),
    ],
)
def test_units_of_all_columns_count(tmp_path, head, factors):
    one = found(pull(export(tmp_path / "a.csv", head=head, factors=factors, step=0.02)))
    assert one["crossing_friction_n"] == pytest.approx([FRICTION], rel=2e-3)


@pytest.mark.parametrize(
    ("head", "said"),
    [
        ("Weg [mm];freies Ende [mm];Kraft", r"a\.csv:1: column 'Kraft' has no unit of force; write 'Kraft \[N\]', or"),
        ("Weg;freies Ende [mm];Kraft [N]", "column 'Weg' has no unit of length"),
        ("Weg [mm];freies Ende;Kraft [N]", "column 'freies Ende' has no unit of length"),
        ("Weg [cm];freies Ende [mm];Kraft [N]", "its clamp moves by 197.*its free end by 19.7.* mm; expected about"),
        ("Weg [mm];freies Ende [mm];Kraft [kN]", r"are 20 and 20 N per crossing|implausible"),
        ("Weg [mm];freies Ende [mm];Kraft [kgf]", None),
        ("Weg [mm];freies Ende [mm];Druck [N]", "no header row names a force and a displacement"),
    ],
)
def test_units_that_are_missing_or_cannot_be_are_refused(tmp_path, head, said):
    path = export(tmp_path / "a.csv", head=head)
    if said is None:
        assert found(pull(path))["crossing_friction_n"] == pytest.approx([9.80665 * FRICTION], rel=1e-3)
        return
    refused(said, lambda: found(pull(path)))


BOTH = "Weg [cm];freies Ende [cm];Kraft [N]"


@pytest.mark.parametrize(
    ("how", "words"),
    [
        ({"head": BOTH, "step": 0.02}, r"between the rows where the inlay begins to slide"),
        ({"head": BOTH, "step": 0.004, "travel": 30.0}, r"N where all 50 mm are out, .* N before; expected about 0"),
        ({"factors": (0.1, 0.1, 1.0)}, r"slide of all inlays is 1\.\d+ mm; .* at least the distance .*, 3\.57"),
        ({"step": 0.4}, r"0\.2 mm between the rows where the inlay begins to slide; expected at most 0\.04 mm"),
        ({"factors": (1.0, 1.0, -1.0)}, "but tension counts as positive; give --sign negative"),
    ],
)
def test_ways_in_another_unit_and_a_force_of_another_sign_do_not_fit(tmp_path, how, words):
    """The same unit slip in both ways: by a factor of ten too short, or the inlay is out and still held."""
    refused(words, lambda: found(pull(export(tmp_path / "a.csv", **how))))
    path = export(tmp_path / "a.csv", factors=(-1.0, -1.0, -1.0))
    assert found(pull(path, sign="negative"))["crossing_friction_n"] == pytest.approx([FRICTION], rel=1e-3)


def test_a_clamp_alone_says_not_where_the_inlay_slides(tmp_path):
    path = export(tmp_path / "a.csv", followed=False, head="Weg [mm];Kraft [N]", slack=SLACK)
    refused(r"no column of the free end.*give --zero, the displacement at which", pull, path)
    refused(r"--zero 90: expected a displacement of the file, 0 to 20", pull, path, zero=90.0)
    one = pull(path, zero=SLACK + STRETCH)
    assert found(one)["pull_out_at_rest_n"] == pytest.approx([FRICTION * CROSSINGS], rel=3e-3)
    assert any("free end was not measured" in line for line in LAB.lines([one]))
    refused("--zero: .* column of the free end", pull, export(tmp_path / "b.csv"), zero=1.0)
    both = export(tmp_path / "c.csv", followed=False, head="Weg [mm];Kraft [N]", slack=SLACK, factors=(-1.0, 1.0, -1.0))
    other = found(pull(both, sign="negative", zero=-SLACK - STRETCH))
    assert other == {name: pytest.approx(values) for name, values in found(one).items()}


def test_a_yarn_that_breaks_is_none_that_slides(tmp_path):
    path = export(tmp_path / "a.csv", followed=False, head="Weg [mm];Kraft [N]")
    head, *rows = path.read_text().splitlines()
    path.write_text("\n".join([head, *(r if k < 1500 else f"{r.split(';')[0]};0,0001" for k, r in enumerate(rows))]))
    refused(r"falls from 0\.0\d+ to \S+ N per crossing. If the yarn broke", pull, path, zero=STRETCH)


def test_a_preload_is_held_against_the_force_at_rest(tmp_path):
    """0.05 N are 4 % of the largest force, and 18 % of that at which the inlay lets go."""
    path = export(tmp_path / "a.csv", wave=3.0, preload=0.05)
    refused(r"the force starts at 0\.0\d+ N \(the inlay begins to slide at 0\.3\d+ N", pull, path)
    assert found(pull(path, preload="subtract"))["crossing_friction_n"] == pytest.approx([2.5 * FRICTION], rel=0.03)
    assert found(pull(path, preload="keep"))["pull_out_at_rest_n"] == pytest.approx([0.33], rel=0.02)


def test_an_inlay_that_is_drawn_out_counts_until_a_pitch_is_left(tmp_path):
    whole, short = (found(pull(export(tmp_path / f"{t:g}.csv", travel=t))) for t in (70.0, LENGTH - PITCH + STRETCH))
    assert whole == {name: pytest.approx(value, rel=2e-3) for name, value in short.items()}


def test_what_the_force_hangs_on_must_be_known(tmp_path):
    path = export(tmp_path / "a.csv")
    density, length = {"crossing_density_per_100_mm": DENSITY}, {"embedded_length_mm": LENGTH}
    refused(r"states no embedded length: give --embedded-length \[mm\]", pull, path, sizes=density)
    refused(r"no density of the crossing yarns: give --crossing-density", pull, path, sizes=length)
    refused("the clamped edges are unknown", pull, path, clamped=None)
    path.write_text(f"embedded length: 5 cm\nCrossing density;2,8;yarn/mm\n{path.read_text()}")
    refused("has the unit 'yarn/mm'; expected one of yarn/100 mm, yarn/cm, yarn/inch", pull, path, sizes={})
    path.write_text(path.read_text().replace("2,8;yarn/mm", "28;yarn/cm"))
    refused("Crossing density 280: implausible", pull, path, sizes={})
    path.write_text(path.read_text().replace("28;yarn/cm", "2,8;yarn/cm"))
    one = pull(path, sizes={})
    assert (one.length, one.density) == (LENGTH, pytest.approx(DENSITY))


def test_inlays_of_another_unit_copies_and_other_lengths_are_no_series(tmp_path):
    one, two = pull(export(tmp_path / "a.csv")), pull(export(tmp_path / "e.csv", friction=0.021))
    for other, said in (
        (pull(export(tmp_path / "b.csv", friction=0.2)), r"b\.csv: specimen b: force while it slides 2\."),
        (replace(one, name="c"), "specimens a and c have the same curve"),
        (replace(pull(export(tmp_path / "d.csv", noise=0.01)), length=30.0), "embedded length 30 mm"),
    ):
        refused(said, found, one, two, other)
