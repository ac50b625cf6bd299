"""Sections of a bent strip: moments of known loads, turns into a known arc, and the strip they bring to rest."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.laboratory.cantilever import meso_strip as yarn_cantilever
from knittest.laboratory.cantilever.macro_strip import Sections
from knittest.runs.specimen import run_specimen

LENGTH = 160.0


def strip() -> np.ndarray:
    """Nodes of a strip two high, a millimetre apart, held behind 0; positions (n, 3) [mm]."""
    along = np.arange(-2.0, LENGTH + 0.5)
    return np.vstack([np.column_stack([np.zeros_like(along), along, np.full_like(along, z)]) for z in (-1.0, 1.0)])


def test_moments_of_an_even_weight_are_those_of_a_beam():
    """M = w (L - s)^2 / 2 within half a section's weight, and a force along the strip at its surface adds its lever."""
    flat = strip()
    sections = Sections(flat, np.ones(len(flat)), LENGTH)
    force = np.zeros_like(flat)
    force[:, 2] = -0.5e-3
    inner = slice(1, -1)
    found, expected = sections.moments(flat, force), 0.5e-3 * (LENGTH - sections.arc) ** 2
    assert found[inner] == pytest.approx(expected[inner], abs=0.5e-3 * LENGTH)
    pulled = np.where((flat[:, 1] == LENGTH) & (flat[:, 2] > 0), 0.2, 0.0)
    force[:, 1] = pulled
    assert sections.moments(flat, force)[inner] - found[inner] == pytest.approx(0.2, abs=1e-12)


def test_turns_are_limited():
    sections = Sections(np.column_stack([np.zeros(50), np.linspace(0.0, 40.0, 50), np.zeros(50)]), np.ones(50), 40.0)
    even = np.full(len(sections.arc), 0.01)  # 0.4 rad at the end
    assert sections.limit_turns(even, 0.5) == pytest.approx(even)
    assert sections.limit_turns(even, 0.2) == pytest.approx(0.5 * even)
    assert sections.limit_turns(-even, 0.2) == pytest.approx(-0.5 * even)


def test_an_even_curvature_makes_an_arc():
    """Nodes at height h lie on the circle of radius 1 / k + h; turns are k s; what is held stays."""
    flat, curvature = strip(), 1e-2
    sections = Sections(flat, np.ones(len(flat)), LENGTH)
    position, turn = sections.turn(flat, np.full(len(sections.arc), curvature))
    held = flat[:, 1] <= 0.0
    assert (position[held] == flat[held]).all()
    free = (flat[:, 1] > 5.0) & (flat[:, 1] < LENGTH - 5.0)
    assert turn[free] == pytest.approx(curvature * flat[free, 1], rel=1e-9)
    radius = np.hypot(position[free, 1], position[free, 2] + 1.0 / curvature)
    assert radius == pytest.approx(1.0 / curvature + flat[free, 2], abs=0.03)


def rest(**changes: str) -> dict[str, float]:
    sets = {"rig.overhang": "90", "rig.width": "8", "rig.gravity": "60"} | {
        k.replace("__", "."): v for k, v in changes.items()
    }
    run = resolve(
        variant="1", scale="meso", preset="quick", test="cantilever", direction="warp",
        sets=[f"{k}={v}" for k, v in sets.items()],
    )  # fmt: skip
    found = run_specimen(run)
    assert found.quality.failures == ()
    return found.results


def test_a_strip_stiffer_than_its_inlays_comes_to_the_same_rest(monkeypatch):
    """Thick loops stiffen thin inlays: a quarter of the stiffness is assumed, until the first turns show it."""
    first, inlay_stiffness = rest()["chord_angle_deg"], yarn_cantilever._inlay_stiffness
    monkeypatch.setattr(yarn_cantilever, "_inlay_stiffness", lambda *given: 0.25 * inlay_stiffness(*given))
    assert rest()["chord_angle_deg"] == pytest.approx(first, abs=0.3)


def test_rest_is_the_same_whatever_the_way_to_it(monkeypatch):
    """Another assumed stiffness, another first settling; friction of the fabric, which the strip does not take: 0.3 deg
    are 0.3 % of the overhang.
    """
    first = rest()["chord_angle_deg"]
    monkeypatch.setattr(yarn_cantilever, "STIFFENING_FACTOR", 2.4)
    monkeypatch.setattr(yarn_cantilever, "SETTLE", 12_500)
    other = rest(fabric__contact__friction_coefficient="0.5")["chord_angle_deg"]
    assert other == pytest.approx(first, abs=0.3)
