"""Vibrations and waves of beams against closed forms, posed through :mod:`knittest.pose`."""

import numpy as np
from cases.row import Row
from cases.series import BEAM, beam, converging, line, order
from scipy.optimize import least_squares

from knittest.pose import ALL, Body, Table

EI, MASS = BEAM["bending"], BEAM["linear_density"]
#: roots of cos b cosh b = -1
ROOTS = np.array([1.8751040687, 4.6940911330, 7.8547574382])


def shape(root: float, x: np.ndarray) -> np.ndarray:
    """Bending mode of a cantilever of unit length, 2 at the tip."""
    share = (np.cosh(root) + np.cos(root)) / (np.sinh(root) + np.sin(root))
    return np.cosh(root * x) - np.cos(root * x) - share * (np.sinh(root * x) - np.sin(root * x))


def strongest(time: np.ndarray, record: np.ndarray, guess: np.ndarray) -> np.ndarray:
    """Circular frequencies near ``guess`` whose sines and cosines fit ``record`` best."""

    def misfit(share: np.ndarray) -> np.ndarray:
        phase = np.outer(time, share * guess)
        waves = np.hstack([np.sin(phase), np.cos(phase)])
        return waves @ np.linalg.lstsq(waves, record, rcond=None)[0] - record

    record = record / np.abs(record).max()
    return guess * least_squares(misfit, np.ones(len(guess)), xtol=1e-12).x


def frequencies() -> list[Row]:
    """First three bending frequencies of a cantilever, omega = b^2 sqrt(EI / (m L^4)), cos b cosh b = -1.

    Clough & Penzien, Dynamics of Structures. Struck with the three modes at once, one period of the first. The scaled
    rotary inertia m h^3 / 8 of a node vanishes with the mesh; shear takes 3e-4 of the third.
    """
    exact = ROOTS**2 * np.sqrt(EI / MASS)
    found = []
    for n in (8, 16, 32):
        body = beam(line(n), axial=3e5)
        body.boundary.move([0], ALL)
        x = np.linspace(0.0, 1.0, n + 1)
        body.velocity[:, 2] = 1e-3 * sum(shape(root, x) for root in ROOTS)
        record: list[tuple[float, float]] = []
        body.advance(
            2.0 * np.pi / exact[0], lambda b, out=record, tip=n: out.append((b.time, float(b.position[tip, 2])))
        )
        found.append(strongest(*np.array(record).T, exact))
    case, source = "cantilever vibration", "Clough & Penzien 1993"
    return [
        converging(case, source, f"frequency {k + 1} [rad/ms]", exact[k], [f[k] for f in found], "8, 16, 32")
        for k in range(3)
    ]


def bar_wave() -> list[Row]:
    """A pulse P(t) on the free end of a bar: 2 P(t - L / c) at the clamp, back after 2 L / c with v = -2 P / (m c).

    c = sqrt(EA / m); Graff (1975), Wave Motion in Elastic Solids. The fourth power of a sine, 0.5 L / c
    long; order of the largest deviation of the reaction.
    """
    speed = np.sqrt(BEAM["axial"] / MASS)
    width = 0.5 / speed
    t = np.linspace(0.0, width, 400)
    pulse = Table(tuple(t), tuple(np.sin(np.pi * t / width) ** 4))
    errors, peaks, speeds, returns = [], [], [], []
    for n in (50, 100, 200):
        body = beam(line(n))
        held = body.boundary.move([0], ALL)
        body.boundary.load([n], "x", 1.0, pulse)
        record = []
        while body.time < 2.6 / speed:
            record.append(_step(body, held, n))
        time, reaction, velocity = np.array(record).T
        once = time < 1.0 / speed + 1.2 * width
        arrived = np.interp(time - 1.0 / speed, t, pulse.value, left=0.0, right=0.0)
        errors.append(float(np.abs(reaction + 2.0 * arrived)[once].max()))
        peaks.append(float(-reaction.min()))
        middle = float((time * reaction)[once].sum() / reaction[once].sum())
        speeds.append(1.0 / (middle - 0.5 * width))
        returns.append(float(velocity.min() * MASS * speed))
    case, source, mesh, rate = "bar wave", "Graff 1975", "50, 100, 200", order(errors)
    return [
        Row(case, source, "speed [mm/ms]", speed, speeds[-1], mesh, None),
        Row(
            case, source, "reaction at the clamp over P [-]", 2.0, peaks[-1], mesh, rate, tuple(0.5 * e for e in errors)
        ),
        Row(case, source, "velocity of the end over P / (m c), back [-]", -2.0, returns[-1], mesh, None),
    ]


def _step(body: Body, held: int, n: int) -> tuple[float, float, float]:
    """Time [ms] and reaction [N] at the start of a step, velocity of node ``n`` after it."""
    time = body.time
    body.step(1)
    return time, body.reaction(held), float(body.velocity[n, 0])


def rows() -> list[Row]:
    """All dynamic cases of beams."""
    return [*frequencies(), *bar_wave()]
