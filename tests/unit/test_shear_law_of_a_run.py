"""A picture frame of yarns as the shear law of the shells."""

import json

import numpy as np
import pandas as pd
import pytest

from knittest.base.errors import InputError
from knittest.cli.main import run as knittest
from knittest.config.dumping import dump
from knittest.config.loading import resolve
from knittest.experiment.curves import load_curve
from knittest.laboratory.picture_frame.shear_law import homogenised_law, write_law


def frame_curve(law, noise=0.0):
    """Normalised force of a frame whose material follows ``law``: conjugate = normalised cos gamma."""
    angle = np.linspace(0.0, 45.0, 2000)
    shaken = law(angle) * (1.0 + noise * np.sin(40.0 * angle))
    return angle, shaken / np.cos(np.deg2rad(angle))


def test_a_law_comes_back():
    angle, force = homogenised_law(*frame_curve(lambda a: 1e-3 * a + 1e-5 * a**2))
    assert (angle[0], force[0]) == (0.0, 0.0)
    assert force == pytest.approx(1e-3 * angle + 1e-5 * angle**2, rel=5e-3)


def test_a_shaken_law_does_not_fall():
    angle, force = homogenised_law(*frame_curve(lambda a: np.minimum(1e-3 * a, 0.01), noise=0.3))
    assert (np.diff(force) >= 0.0).all() and (np.diff(angle) > 0.0).all()
    assert force[-1] == pytest.approx(0.01, rel=0.05)


def test_only_the_first_loading_counts():
    angle, force = frame_curve(lambda a: 1e-3 * a)
    back = homogenised_law(np.append(angle, angle[::-1]), np.append(force, -force))
    assert back[1] == pytest.approx(homogenised_law(angle, force)[1])


def test_the_stop_of_the_frame_does_not_flatten_the_law():
    """The force falls where the frame comes to rest, 0.3 deg into a step; the law keeps its tangent to the end."""
    angle = np.linspace(0.0, 45.3, 2000)
    force = (1e-3 * angle * np.where(angle > 44.5, 0.9, 1.0)) / np.cos(np.deg2rad(angle))
    found = homogenised_law(angle, force)
    assert found[0][-1] == pytest.approx(43.75, abs=0.05)
    assert np.diff(found[1])[-1] / np.diff(found[0])[-1] > 0.5e-3


def run_folder(folder, law, refused=(), **of):
    (folder / "config.yaml").write_text(dump(resolve(variant="2", test="picture-frame", preset="quick", **of)))
    angle, force = frame_curve(law)
    table = pd.DataFrame({"frame_shear_angle_deg": angle, "normalised_shear_force_n_per_mm": force})
    table.to_csv(folder / "curve.csv", index=False)
    (folder / "summary.json").write_text(json.dumps({"refused": refused}))
    return folder


def test_the_file_says_what_its_force_hangs_on_and_is_read_as_a_law(tmp_path):
    sets = ["fabric.contact.friction_coefficient=0.4"]
    run = run_folder(tmp_path, lambda a: 1e-3 * a, scale="meso", sets=sets)
    angle, force = write_law(run, tmp_path / "mine" / "law.csv")
    text = (tmp_path / "mine" / "law.csv").read_text()
    assert "# yarn-yarn friction coefficient: 0.4 (user)" in text
    assert "# degree of set of the loops: 0.9 (assumed)" in text and "patch" not in text and "draw-in" not in text
    curve = load_curve(tmp_path / "mine" / "law.csv")
    assert (curve.kind, curve.source) == ("simulated", "picture frame of yarns, pham2019-v2 (calibrated), 50 mm")
    assert curve.x == pytest.approx(angle, abs=1e-4) and curve.mean == pytest.approx(force, abs=1e-6)


def test_the_file_names_patches_and_draw_in_where_the_fabric_states_them(tmp_path):
    drawn = ["fabric.knitting.draw_in=0.5"]
    run = run_folder(tmp_path, lambda a: 1e-3 * a, scale="meso", parameters="gripping", sets=drawn)
    write_law(run, tmp_path / "law.csv")
    head = (tmp_path / "law.csv").read_text()
    assert "# draw-in of the loops [%]: 0.5 (user)\n" in head
    for pair, radius in (("inlays", 0.375), ("inlay and loop", 0.306), ("loops", 0.25)):
        assert f"# patch of a crossing, {pair} [mm]: {radius:g} (assumed)\n" in head


def test_a_frame_that_its_gates_refused_is_no_law(tmp_path):
    run = run_folder(tmp_path, lambda a: 1e-3 * a, refused=["energy error 7 % > 5 %"], scale="meso")
    with pytest.raises(InputError, match=r"quality checks failed \(energy error 7 % > 5 %\)"):
        write_law(run, tmp_path / "law.csv")
    (run / "summary.json").unlink()
    with pytest.raises(InputError, match="expected a finished run: continue with knittest resume"):
        write_law(run, tmp_path / "law.csv")
    assert not (tmp_path / "law.csv").exists()


def test_shells_have_no_law_of_their_own(tmp_path):
    run = run_folder(tmp_path, lambda a: 1e-3 * a, scale="macro")
    with pytest.raises(InputError, match="expected a picture frame of yarns"):
        write_law(run, tmp_path / "law.csv")


def test_folders_without_a_frame_are_refused(tmp_path):
    with pytest.raises(InputError, match="expected the folder of a finished picture-frame run"):
        write_law(tmp_path, tmp_path / "law.csv")
    (tmp_path / "curve.csv").write_text("strain_pct,force_n\n0,0\n1,5\n")
    assert knittest(["data", "shear-law", str(tmp_path), "--out", str(tmp_path / "law.csv")]) == 2
