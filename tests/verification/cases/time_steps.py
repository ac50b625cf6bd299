"""Time integration: order, energy, bits; posed through :mod:`knittest.pose`."""

import numpy as np
from cases.row import Row
from cases.series import beam, converging, line, order, order_without_reference

from knittest.pose import ALL, Body, Chain, YarnContact, ramp, section


def oscillator() -> list[Row]:
    """One bar and a mass: x = v / omega sin(omega t); x_n = v dt sin(n p) / sin p, sin(p / 2) = omega dt / 2.

    The second is what central differences do exactly: Hughes (2000), The Finite Element Method, section 9.1.
    """
    velocity, ends, exact, discrete = 1.0, [], 0.0, 0.0
    for halving in (1, 2, 4):
        body = beam(line(1), axial=1e3)
        body.dt = 0.2 / halving * body.model.critical_step
        body.boundary.move([0], ALL)
        body.boundary.move([1], ALL[1:])
        body.velocity[1, 0] = velocity
        omega = np.sqrt(1e3 / body.model.mass[1])
        steps = 64 * halving
        body.step(steps)
        p = 2.0 * np.arcsin(0.5 * omega * body.dt)
        exact = velocity / omega * np.sin(omega * body.time)
        discrete = velocity * body.dt * np.sin(steps * p) / np.sin(p)
        ends.append(body.position[1, 0] - 1.0)
    case, source, quantity = "bar and mass", "Hughes 2000", "displacement after 2.4 periods [mm]"
    return [
        converging(case, source, quantity, exact, ends, "dt, dt/2, dt/4"),
        Row(case, source, "the same, central differences [mm]", discrete, ends[-1], "dt/4", None),
    ]


def swinging_beam(halving: int, steps: int = 0) -> Body:
    """A cantilever of four elements that bends and twists: P L^2 / EI = 1 over a smooth rise, half of it aside, slower.

    Four times the load turns an element by 60 degrees and makes the motion chaotic: the energy error then grows.
    """
    body = beam(line(4), axial=1e3)
    body = Body(body.model, safety=0.8 / halving)
    body.boundary.move([0], ALL)
    body.boundary.load([4], "z", 1.0, ramp(0.02, 1.0))
    body.boundary.load([4], "y", 0.5, ramp(0.05, 1.0))
    if steps:
        body.step(steps * halving)
    return body


def second_order() -> list[Row]:
    """A cantilever that swings by half its length: the tip at one instant converges with dt^2.

    Hughes (2000), section 9.1: central differences are second order. Reference: extrapolation of the last two.
    """
    tips = [float(swinging_beam(halving, 300).position[4, 2]) for halving in (1, 2, 4)]
    reference = tips[-1] + (tips[-1] - tips[-2]) / 3.0
    rate, series = order_without_reference(tips), tuple(abs(t / reference - 1.0) for t in tips)
    mesh = "dt, dt/2, dt/4"
    return [Row("swinging beam", "Richardson's limit", "tip [mm]", reference, tips[-1], mesh, rate, series)]


def energy_drift() -> list[Row]:
    """A free large vibration for 60 periods: the energy error stays bounded by (omega dt)^2 and has no trend.

    Hairer, Lubich & Wanner (2003), Acta Numerica 12, 399: the energy of Stoermer-Verlet oscillates and does not drift.
    """
    spread, drift = [], []
    for halving in (1, 2):
        body = swinging_beam(halving, 150)
        error, work = [], 0.0
        for _ in range(400):
            body.step(50 * halving)
            e = body.energies()
            error.append(e["balance"])
            work = max(work, e["external"])
        half = len(error) // 2
        spread.append(float(np.abs(error).max() / work))
        drift.append(abs(float(np.mean(error[half:]) - np.mean(error[:half]))) / work)
    case, source = "energy of a swinging beam", "Hairer, Lubich & Wanner 2003"
    return [
        Row(case, source, "largest error over work [-]", 0.0, spread[-1], "dt, dt/2", order(spread), tuple(spread)),
        Row(case, source, "second half less first half [-]", 0.0, drift[-1], "dt/2", None),
    ]


def struck_yarns(threads: int) -> bytes:
    """All bits of the state of four yarns after an impact with friction."""
    points = np.column_stack([np.arange(-2.0, 2.01, 0.2), np.zeros(21), np.zeros(21)])
    law = section(1e4, 5.0, 0.2, 1e-3)
    chains = [Chain(points + np.array([0.0, 0.3 * k, 0.0]), law) for k in (-1, 1)]
    chains += [Chain(points[:, [1, 0, 2]] + np.array([0.3 * k, 0.0, 0.42]), law) for k in (-1, 1)]
    body = Body.of_chains(chains, YarnContact(500.0, 250.0, 0.2), threads=threads)
    body.velocity[42:] = [3.0, 5.0, -10.0]
    body.step(3000)
    state = body.model.state()
    return b"".join(state[name].tobytes() for name in sorted(state))


def same_bits() -> list[Row]:
    """The state after 3000 steps on one and two threads: not a bit differs, because sums have a fixed order."""
    one, two = (np.frombuffer(struck_yarns(threads), np.uint8) for threads in (1, 2))
    differing = float((one != two).sum())
    return [Row("one and two threads", "identity", "bytes that differ", 0.0, differing, "84 nodes", None)]


def rows() -> list[Row]:
    """All cases of the time integration."""
    return [*oscillator(), *second_order(), *energy_drift(), *same_bits()]
