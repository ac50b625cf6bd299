"""A picture frame of yarns as the shear law of the shells."""

import numpy as np
import pytest

from knittest.cli.main import run as knittest
from knittest.errors import InputError
from knittest.experiment.shear_law import homogenised_law, write_law


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


def test_folders_without_a_frame_are_refused(tmp_path):
    with pytest.raises(InputError, match="expected the folder of a finished picture-frame run"):
        write_law(tmp_path, tmp_path / "law.csv")
    (tmp_path / "curve.csv").write_text("strain_pct,force_n\n0,0\n1,5\n")
    assert knittest(["data", "shear-law", str(tmp_path), "--out", str(tmp_path / "law.csv")]) == 2
