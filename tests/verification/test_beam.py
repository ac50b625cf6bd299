"""Beams against closed forms: elastica, rigid rotation, bar wave, wavy yarn, bundle.

Tolerances follow the method: second order in the element length, some tenths of a percent at these meshes.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from yarn_cases import Driver, card, clamp, yarns

from knittest.fabric.variability import YarnDraws, bundle_peak
from knittest.kernels.monitor import axial_state
from knittest.materials.yarn_section import sections

# Cantilever under an end force: P L^2 / EI, transverse and axial tip displacement over length (Mattiasson, 1981)
ELASTICA = [(1.0, 0.30172, 0.05643), (5.0, 0.71379, 0.38763)]


@pytest.mark.parametrize(("load", "across", "along"), ELASTICA)
def test_cantilever_follows_the_elastica(load, across, along):
    n, length = 20, 12.0
    run = card("model.meso.contact=false")
    model = yarns(run, np.column_stack([np.zeros(n + 1), np.linspace(0.0, length, n + 1), np.zeros(n + 1)]))
    clamp(model, 0)
    bending = sections(run.fabric)[0].bending
    slowest = 3.516 * np.sqrt(bending / (1.2e-3 * length**4))  # first circular frequency of the straight cantilever
    drive = Driver(model, damping=2.0 * slowest)
    drive.load[2, n] = load * bending / length**2
    drive.step(int(12.0 / slowest / drive.dt), loaded=True)
    tip = model.position()[n]
    assert np.abs(model.nodes.velocity).max() < 1e-2
    assert tip[2] / length == pytest.approx(across, rel=0.004)
    assert 1.0 - tip[1] / length == pytest.approx(along, rel=0.012)


def test_rigid_rotation_makes_no_force():
    n = 12
    arc = np.linspace(0.0, 1.5, n + 1)
    curve = np.column_stack([4.0 * np.sin(arc), 4.0 * np.cos(arc), 0.5 * arc])
    model = yarns(card("model.meso.contact=false"), curve)
    turn = Rotation.from_rotvec([1.2, -0.7, 2.0])
    model.nodes.position[:, : n + 1] = turn.apply(curve).T
    x, y, z, w = turn.as_quat()
    model.nodes.rotation[:] = np.array([[w], [x], [y], [z]])
    drive = Driver(model)
    drive.step(1)
    assert np.abs(model.nodes.force[:, : n + 1]).max() < 1e-8  # EA is 46 kN
    assert float(model.stored().internal.sum()) < 1e-12


def test_an_end_pull_travels_with_the_bar_wave_speed():
    n, length = 400, 160.0
    run = card("model.meso.contact=false")
    model = yarns(run, np.column_stack([np.zeros(n + 1), np.linspace(0.0, length, n + 1), np.zeros(n + 1)]))
    axial = sections(run.fabric)[0].axial
    speed = np.sqrt(axial / 1.2e-3)
    drive = Driver(model)
    drive.load[1, n] = 50.0
    drive.step(round(0.5 * length / speed / drive.dt), loaded=True)
    velocity = model.nodes.velocity[1, : n + 1]
    front = length - np.linspace(0.0, length, n + 1)[np.argmax(velocity > 0.5 * velocity[n - 40])]
    assert front == pytest.approx(0.5 * length, abs=3 * length / n)
    # behind the front the yarn moves at P / sqrt(EA m)
    assert velocity[n - 160 : n - 20].mean() == pytest.approx(50.0 / np.sqrt(axial * 1.2e-3), rel=0.02)


def test_a_wavy_yarn_straightens_in_closed_form():
    """eps(T) = T/EA + c0 [1 - (1 + T/T*)^-2], T* = EI (2 pi / lambda)^2, for a shallow wave."""
    wavelength, waves, per_wave, amplitude = 3.5714, 6, 24, 0.06
    run = card("model.meso.contact=false")
    y = np.linspace(0.0, waves * wavelength, waves * per_wave + 1)
    wave = np.column_stack([np.zeros_like(y), y, amplitude * np.cos(2.0 * np.pi * y / wavelength)])
    section = sections(run.fabric)[0]
    crimp = np.linalg.norm(np.diff(wave, axis=0), axis=1).sum() / y[-1] - 1.0
    star = section.bending * (2.0 * np.pi / wavelength) ** 2
    for tension in (0.3 * star, 3.0 * star):
        model = yarns(run, wave)
        for end in (0, len(y) - 1):  # symmetry: crests stay level
            model.nodes.inv_inertia[end] = 0.0
        drive = Driver(model, damping=60.0)
        drive.load[1, 0], drive.load[1, -2] = -tension, tension
        drive.step(12000, loaded=True)
        stretch = np.ptp(model.position()[:, 1]) / y[-1] - 1.0
        expected = tension / section.axial + crimp * (1.0 - (1.0 + tension / star) ** -2)
        assert stretch == pytest.approx(expected, rel=0.02)


def test_tabulated_law_and_slack_carry_what_the_table_says():
    run = card(
        "model.meso.contact=false", "fabric.reinforcing.law={kind: table, points: [[0, 0], [0.4, 80], [1.2, 500]]}"
    )
    area = run.fabric.reinforcing.kernel("load_area")
    line = np.column_stack([np.zeros(5), np.arange(5.0), np.zeros(5)])
    loose = {"warp": YarnDraws(np.full(1, 1.0), np.full(1, 0.001), np.ones(1), np.full(1, 0.5))}
    model = yarns(run, line, draws=loose)
    for strain, stress in ((0.0005, 0.0), (0.003, 40.0), (0.009, 290.0)):
        model.nodes.position[1, :5] = (1.0 + strain) * np.arange(5.0)
        force = axial_state(model.nodes, model.parts, model.beams)[1, 1]
        assert force == pytest.approx(stress * area, abs=1e-9)


def test_bundle_formula_is_daniels():
    strains = np.array([0.008, 0.012, 0.009, 0.011])
    draws = YarnDraws(strains, np.zeros(4), np.ones(4), np.full(4, 0.5))
    expected = max(46.5e3 * e * (4 - k) for k, e in enumerate(np.sort(strains)))
    assert bundle_peak(draws, 46.5e3)[0] == pytest.approx(expected)
