"""Import of friction tests: levels, coefficients of one and two faces, and what must be known for them."""

from dataclasses import replace

import numpy as np
import pytest
from strip_reading import refused

from knittest.config.loading import resolve
from knittest.experiment.conditions import UNKNOWN
from knittest.experiment.lab_table import ReadOptions
from knittest.experiment.tables import published_rows
from knittest.laboratory.friction import rig
from knittest.laboratory.friction.lab_files import KINETIC_SHARE
from knittest.laboratory.friction.lab_files import LAB as FRICTION
from knittest.laboratory.report_base import REPORTS
from knittest.runs.run_files import references_of

HEAD = "Normalkraft;2,0;kN\nPlattenlänge;150;mm\nPlattenbreite;50;mm\n"


def friction_file(path, kinetic=300.0, peak=330.0, offset=0.0, start=0.0, head=HEAD, more=""):
    """Rises to ``peak`` [N] at 1 mm, falls to ``kinetic`` at 4 mm and stays there to 20 mm."""
    way = np.linspace(0.0, 20.0, 201)
    force = np.interp(way, [0.0, 1.0, 4.0, 20.0], [0.0, peak, kinetic, kinetic]) + offset
    rows = "".join(f"{w + start:.2f};{f:.3f}\n" for w, f in zip(way, force, strict=True)).replace(".", ",")
    path.write_text(f"{head}Weg [mm];Kraft [N]\n{rows}{more}", encoding="utf-8")
    return path


def read(folder, way, force, head="Weg [mm];Kraft [N]"):
    """Strip of a recording."""
    rows = "".join(f"{w:.4f};{f:.2f}\n" for w, f in zip(way, force, strict=True)).replace(".", ",")
    (folder / "a.csv").write_text(f"{HEAD}{head}\n{rows}", encoding="utf-8")
    return FRICTION.read(folder / "a.csv", ReadOptions())[0]


def series(folder, *kinetic):
    """Strips that differ in their level."""
    return [
        FRICTION.read(friction_file(folder / f"{k}.csv", f, 1.1 * f), ReadOptions())[0] for k, f in enumerate(kinetic)
    ]


def test_levels_and_coefficients_say_what_they_are(tmp_path):
    (strip,) = FRICTION.read(friction_file(tmp_path / "a.csv", start=3.0), ReadOptions())
    assert strip.sizes == (2000.0, 150.0, 50.0) and strip.travel[0] == 0.0
    found = FRICTION.results([strip], "warp", []).found
    expected = {"pull_force_static_n": 330.0, "pull_force_kinetic_n": 300.0, "mu_paper": 0.15, "mu_per_face": 0.075,
                "mu_static_per_face": 0.0825}  # fmt: skip
    assert {name: values[0] for name, values in found.items()} == pytest.approx(expected)
    assert KINETIC_SHARE == rig.KINETIC_SHARE
    text = "\n".join(FRICTION.lines([strip]))
    assert "2 faces rubbing" in text and "last half of the travel" in text


def test_the_mean_is_over_travel_and_not_over_samples(tmp_path):
    """A machine that writes more rows while the clamp is slow: 300 N at 10 to 15 mm, 280 N at 15 to 20 mm."""
    way = np.concatenate([np.linspace(0.0, 10.0, 11), np.linspace(10.1, 15.0, 500), np.linspace(15.1, 20.0, 11)])
    force = np.where(way > 15.0, 280.0, 300.0) * np.minimum(way, 1.0)
    strip = read(tmp_path, way, force, "Weg;Kraft")
    assert strip.kinetic == pytest.approx(290.0, abs=0.3)


def test_a_sled_rubs_on_one_face(tmp_path):
    (sled,) = FRICTION.read(friction_file(tmp_path / "a.csv"), ReadOptions(faces=1))
    results = FRICTION.results([sled], "warp", [])
    assert {name: values[0] for name, values in results.found.items()} == pytest.approx(
        {"mu_paper": 0.3, "mu_per_face": 0.15, "mu_static_per_face": 0.165}
    )
    assert "1 face rubbing" in results.what[1]


def test_the_way_back_does_not_count(tmp_path):
    back = "19,0;-150\n18,0;-250\n10,0;-290\n"
    (strip,) = FRICTION.read(friction_file(tmp_path / "a.csv", more=back), ReadOptions())
    assert strip.kinetic == pytest.approx(300.0) and strip.travel[-1] == pytest.approx(20.0)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("", r"states no normal force .*give --normal-force \[N\]"),
        ("Normalkraft;2000;N\n", r"states no plate length .*give --plate-length \[mm\]"),
        ("Normalkraft;2000;N\nplate length;15;cm\n", r"states no plate width: give --plate-width \[mm\]"),
        (HEAD.replace("2,0;kN", "2,0;N"), r"pull force of 300 N under 2 N is a coefficient of 75 per face"),
        (HEAD.replace("2,0;kN", "0,01;N"), r"Normalkraft 0\.01: implausible, expected 0\.1 to 100000 N \(it looks"),
        (HEAD.replace("2,0;kN", "2,0;ft"), "unit 'ft'"),
    ],
)
def test_what_results_hang_on_must_be_known(tmp_path, head, words):
    refused(words, lambda: FRICTION.lines(FRICTION.read(friction_file(tmp_path / "a.csv", head=head), ReadOptions())))


def test_slips_are_refused(tmp_path):
    path = friction_file(tmp_path / "a.csv", offset=60.0)
    refused(r"the force starts at 60 N \(its maximum is 390 N.*--preload subtract", FRICTION.read, path, ReadOptions())
    assert FRICTION.read(path, ReadOptions(preload="subtract"))[0].kinetic == pytest.approx(300.0)
    path.write_text(friction_file(tmp_path / "b.csv").read_text().replace("Weg [mm]", "Weg [um]"))
    refused(r"over a travel of 0\.02 mm; expected at least 3, over 1 to 1000 mm", FRICTION.read, path, ReadOptions())
    one, two, low = series(tmp_path, 300, 310, 30)
    refused(r"2\.csv: specimen 2: coefficient of a face 0\.0075", FRICTION.results, [one, two, low], "warp", [])
    refused("have the same curve", FRICTION.results, [one, one], "warp", [])


def test_the_folder_of_friction(tmp_path):
    out = tmp_path / "mine"
    assert FRICTION.write(series(tmp_path, 290, 310), out, "warp", ["0.csv", "1.csv"]) == "mine"
    names = ("mu_paper", "mu_per_face", "pull_force_kinetic_n", "normal_force_n")
    mu, *others = published_rows(out, "mine", "warp", names)
    assert [row.mean for row in (mu, *others)] == pytest.approx([0.15, 0.075, 300.0, 2000.0])
    assert mu.sd == pytest.approx(10.0 * np.sqrt(2.0) / 2000.0, rel=1e-4) and mu.table.endswith("2 faces rubbing, warp")
    assert (out / "friction-warp/corridor.csv").is_file() and not (out / "friction-weft").exists()


def test_a_pull_force_belongs_to_its_normal_force(tmp_path):
    out = tmp_path / "mine"
    FRICTION.write(FRICTION.read(friction_file(tmp_path / "a.csv"), ReadOptions()), out, "warp", ["a.csv"])
    rows = published_rows(out, "mine", "warp", ("mu_paper", "pull_force_kinetic_n"))
    run, lighter = (
        resolve(test="friction", variant="1", scale="macro", direction="warp", sets=[f"rig.normal_force={force}"])
        for force in (2000, 500)
    )
    scaled = REPORTS["friction"].scaled
    found = {row.quantity: row for row in scaled(run, rows)}
    assert [found[row.quantity] for row in rows] == rows
    pull = {row.quantity: row for row in scaled(lighter, rows)}["pull_force_kinetic_n"]
    assert (pull.mean, pull.scaled) == (pytest.approx(0.25 * rows[1].mean), "under 500 instead of 2000 N")
    assert scaled(run, [replace(rows[1], conditions=UNKNOWN)]) == []  # of an unknown normal force: nothing to compare


def test_a_coefficient_of_two_faces_is_that_of_one_as_well(tmp_path):
    run = resolve(test="friction", variant="1", scale="macro", direction="warp")
    both, face = references_of(run, ()).rows
    assert (both.quantity, both.mean, both.sd) == ("mu_paper", 0.15, 0.01)
    assert (face.quantity, face.mean, face.sd) == ("mu_per_face", 0.075, 0.005)
    assert face.scaled == "half of F_R/F_N" and both.scaled == ""


def test_a_pull_in_newton_under_a_head_of_kilonewton_looks_like_newton(tmp_path):
    path = friction_file(tmp_path / "a.csv")
    path.write_text(path.read_text(encoding="utf-8").replace("Kraft [N]", "Kraft [kN]"), encoding="utf-8")
    words = r"coefficient of 75 per face: .*it looks like N: 300 N or daN: 3000 N\)"
    refused(words, FRICTION.results, FRICTION.read(path, ReadOptions()), "warp", [])


def test_a_strip_that_sticks_keeps_its_largest_force(tmp_path):
    """400 N are reached at rest, in rows of one travel, before it slides at 300 N."""
    way = np.concatenate([np.zeros(50), np.linspace(0.1, 20.0, 200)])
    force = np.concatenate([np.linspace(0.0, 400.0, 50), np.full(200, 300.0)])
    strip = read(tmp_path, way, force)
    assert (strip.static, strip.kinetic) == pytest.approx((400.0, 300.0))


def test_noise_of_the_travel_is_no_way_back(tmp_path):
    way = np.linspace(0.0, 20.0, 2001)
    noisy = way + 0.06 * np.random.default_rng(1).standard_normal(len(way))
    force = np.interp(way, [0.0, 1.0, 4.0, 20.0], [0.0, 330.0, 300.0, 300.0])
    strip = read(tmp_path, noisy, force)
    assert strip.travel[-1] == pytest.approx(20.0, abs=0.3) and strip.kinetic == pytest.approx(300.0)


@pytest.mark.parametrize(("faces", "words", "of_a_face"), [(1, "of one face", 0.15), (2, "of both faces", 0.075)])
def test_a_coefficient_is_the_pull_over_the_normal_force_and_the_output_says_so(tmp_path, faces, words, of_a_face):
    """A file of the coefficient says what the same file of the force says."""
    path = friction_file(tmp_path / "a.csv", kinetic=0.15, peak=0.165)
    path.write_text(path.read_text(encoding="utf-8").replace("Kraft [N]", "Reibungszahl"), encoding="utf-8")
    (strip,) = FRICTION.read(path, ReadOptions(faces=faces))
    (by_force,) = FRICTION.read(friction_file(tmp_path / "b.csv"), ReadOptions(faces=faces))
    assert strip.kinetic == pytest.approx(by_force.kinetic) == pytest.approx(300.0)
    assert any(f"pull force over normal force, F_R/F_N, {words}" in note for note in strip.notes)
    for one in (strip, by_force):
        assert FRICTION.results([one]).found["mu_per_face"] == pytest.approx([of_a_face])
