"""Contact and friction of yarns against closed forms, posed through :mod:`knittest.pose`."""

import numpy as np
from cases.row import Row
from cases.series import beam, converging, order

from knittest.pose import ALL, Body, Chain, Table, YarnContact, cylinder, plane, ramp, section


def crossing(friction: float, angle: float) -> Row:
    """A yarn pressed by N = 2 N on a fixed one at ``angle`` and drawn over five of its elements: drag mu N.

    Amontons and Coulomb, in Johnson (1985), Contact Mechanics, section 7.1. Mean over the way: N is the load, and the
    pressure swings about it.
    """
    across = np.column_stack([np.arange(-2.0, 2.01, 0.2), np.zeros(21), np.zeros(21)])
    a, press = np.deg2rad(angle), 2.0
    along = np.column_stack([across[:, 0] * np.cos(a), across[:, 0] * np.sin(a), np.full(21, -0.4)])
    law = section(1e4, 5.0, 0.2, 1e-3)
    body = Body.of_chains([Chain(along, law), Chain(across, law)], YarnContact(500.0, 250.0, friction))
    upper = np.arange(21, 42)
    body.boundary.move(np.arange(21), ALL)
    body.boundary.move(upper, ["x", "rx", "ry", "rz"])
    pull = body.boundary.move(upper, ["y"], ramp(0.1, 5.0))
    body.boundary.load(upper, "z", -press / 21.0)
    body.advance(0.1)
    drag: list[float] = []
    body.advance(0.2, lambda b: drag.append(b.reaction(pull)))
    name, source = f"crossing yarns, {angle:g} degrees, mu = {friction:g}", "Johnson 1985"
    return Row(name, source, "drag [N]", friction * press, float(np.mean(drag)), "20 x 20", None)


def capstan() -> list[Row]:
    """A yarn drawn over half a rigid cylinder: T2 = T1 exp(mu theta), theta = pi.

    Euler (1769), Eytelwein (1808). A node that turns the yarn by d multiplies the tension by
    (1 + mu tan(d / 2)) / (1 - mu tan(d / 2)): order 2. Mean while one element passes. Damping against the swing of the
    string takes c m L v = 6e-4 of T1.
    """
    radius, size, friction, hold, speed = 2.0, 0.1, 0.2, 5.0, 0.2
    exact = float(np.exp(np.pi * friction))
    ratios = []
    for n in (6, 12, 24):
        turn = np.linspace(np.pi, 0.0, n + 1)
        h = (radius + size) * np.pi / n
        leg = -h * np.arange(1, n // 2 + 3)
        arc = (radius + size) * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(n + 1)])
        left, right = (np.column_stack([np.full_like(leg, p[0]), leg, 0.0 * leg]) for p in (arc[0], arc[-1]))
        points = np.vstack([left[::-1], arc, right])
        last = len(points) - 1
        law = section(2e3, 1e-3, size, 1e-3)
        body = Body.of_chains([Chain(points, law)], damping=1.0)
        body.boundary.radius[:] = size
        drum = cylinder([0.0, 0.0, 0.0], [0.0, 0.0, 1.0], radius, 10.0)
        drum.friction = (friction, friction)
        body.boundary.add_tool(drum)
        body.boundary.load([0], "y", -hold, ramp(0.5, 1.0))
        pull = body.boundary.move([last], ["y"], ramp(1.0, -speed))
        body.advance(1.0 + h / speed)
        tension: list[float] = []
        body.advance(h / speed, lambda b, out=tension, group=pull: out.append(-b.reaction(group)))
        ratios.append(float(np.mean(tension)) / hold)
    return [converging("capstan", "Euler 1769; Eytelwein 1808", "T2 / T1 [-]", exact, ratios, "6, 12, 24")]


def capstan_exponent(friction: float, drum: float, size: float) -> float:
    """Exponent a of T = T1 exp(a theta) of a limp yarn of radius r = ``size`` drawn over a yarn of R = ``drum``.

    Friction mu p acts where the surfaces touch, p the pressure per length of the centre-line, whose radius is R + r.
    About the centre of the drum its lever is R: dT/dtheta = mu p R. About the centre-line it is r: without bending a
    shear force V = mu p r balances it, which turns with the yarn: p (R + r) = T - dV/dtheta. With p in proportion to
    exp(a theta) both give a (1 + a mu q) = mu k, k = R / (R + r), q = r / (R + r). Without V it would be a = mu k.

    Where the yarn comes on, p starts from 0 and grows over an angle of mu q; where it leaves, V ends in a point force.
    Both together make T2 / T1 larger by x^2 / (1 + 2 x), x = a mu q: at R = r 0.3 % at mu = 0.5, 0.06 % at 0.3.
    """
    k, q = drum / (drum + size), size / (drum + size)
    return float((np.sqrt(1.0 + 4.0 * friction**2 * k * q) - 1.0) / (2.0 * friction * q))


def wrapped(friction: float, n: int = 12, first: bool = True, rise: float = 0.0, drum: float = 0.4) -> Row:
    """A yarn of radius 0.1 mm drawn over half of a fixed yarn of radius ``drum`` [mm], over ``n`` elements:
    T2 = T1 exp(a pi), a of :func:`capstan_exponent`.

    ``rise`` [mm] along the drum makes a helix; ``first`` the number of the yarn, which the search tells apart. Mean
    while one element passes.
    """
    size, hold, speed = 0.1, 5.0, 0.2
    across = np.linspace(np.pi, 0.0, n + 1)
    h = (drum + size) * np.pi / n
    leg = -h * np.arange(1, n // 2 + 3)
    arc = np.column_stack(
        [(drum + size) * np.cos(across), (drum + size) * np.sin(across), rise * np.linspace(-0.5, 0.5, n + 1)]
    )
    left, right = (np.column_stack([np.full_like(leg, p[0]), leg, np.full_like(leg, p[2])]) for p in (arc[0], arc[-1]))
    points = np.vstack([left[::-1], arc, right])
    axis = np.column_stack([np.zeros(13), np.zeros(13), 3.0 * drum * np.linspace(-1.0, 1.0, 13)])
    yarn, fixed = Chain(points, section(2e3, 1e-3, size, 1e-3)), Chain(axis, section(1e4, 5.0, drum, 1e-3))
    law = YarnContact(500.0, 250.0, friction, cut=0)
    body = Body.of_chains([yarn, fixed] if first else [fixed, yarn], law, damping=1.0)
    moves = np.arange(len(points)) + (0 if first else len(axis))
    holds = np.arange(len(axis)) + (len(points) if first else 0)
    body.boundary.move(holds, ALL)
    body.boundary.load([moves[0]], "y", -hold, ramp(0.5, 1.0))
    pull = body.boundary.move([moves[-1]], ["y"], ramp(1.0, -speed))
    body.advance(1.0 + h / speed)
    pulls = [(body.time, 0.0)]  # the end of every chunk of steps, which differ in length, and the mean pull in it
    body.advance(h / speed, lambda b: pulls.append((b.time, -b.reaction(pull))))
    time, pulled = np.array(pulls).T
    tension = float(np.average(pulled[1:], weights=np.diff(time)))
    exact = float(np.exp(np.pi * capstan_exponent(friction, drum, size)))
    name = f"yarn drawn over half a yarn, R / r = {drum / size:g}, mu = {friction:g}" + (", helix" if rise else "")
    return Row(name, "Euler 1769; Eytelwein 1808", "T2 / T1 [-]", exact, tension / hold, str(n), None)


def incline() -> list[Row]:
    """A body on a plane that is tilted slowly: it slips at tan a = mu_s, then speeds up by g (sin a - mu_k cos a).

    Johnson (1985), section 7.1. The tilt is that of gravity; slip is seen after 1 um, 0.05 ms and 0.1 degrees later.
    """
    static, kinetic, g, most = 0.5, 0.3, 10.0, np.deg2rad(35.0)
    body = beam(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.0]]), axial=100.0)
    body.boundary.radius[:] = 0.2
    floor = plane([0.0, 0.0, -0.2], [0.0, 0.0, 1.0])
    floor.friction = (static, kinetic)
    body.boundary.add_tool(floor)
    time = np.linspace(2.0, 19.5, 500)
    tilt = most * (time - 2.0) / 17.5
    weight = g * body.model.mass
    body.boundary.gravity(weight, (1.0, 0.0, 0.0), Table(tuple(time), tuple(np.sin(tilt))))
    body.boundary.gravity(weight, (0.0, 0.0, -1.0), Table(tuple(time), tuple(np.cos(tilt))))
    way: list[tuple[float, float, float]] = []
    body.advance(22.0, lambda b: way.append((b.time, b.position[:, 0].mean() - 0.5, b.velocity[:, 0].mean())))
    t, x, v = np.array(way).T
    slip = float(np.rad2deg(np.interp(t[np.argmax(x > 1e-3)], time, tilt)))
    late = t > 20.0
    rate = float(np.polyfit(t[late], v[late], 1)[0])
    case, source = "body on an incline", "Johnson 1985"
    exact = g * (np.sin(most) - kinetic * np.cos(most))
    return [
        Row(case, source, "angle of slip [deg]", float(np.rad2deg(np.arctan(static))), slip, "2", None),
        Row(case, source, "acceleration [mm/ms^2]", float(exact), rate, "2", None),
    ]


def struck(
    halving: int, friction: float, sideways: float = 0.0, compaction: tuple[int, float] | None = None
) -> tuple[Body, list[dict[str, float]], np.ndarray]:
    """A short stiff yarn that falls at 1 mm/ms on the middle of a free one of three times its mass.

    Returns the body, the energies before and after, and the momentum before and after (2, 3).
    """
    x = np.linspace(-0.4, 0.4, 5)
    zero = np.zeros(5)
    light, heavy = (section(1e5, 100.0, 0.1, m) for m in (1e-3, 3e-3))
    chains = [Chain(np.column_stack([x, zero, zero + 0.205]), light), Chain(np.column_stack([zero, x, zero]), heavy)]
    law = YarnContact(100.0, 50.0, friction, damping=0.0, compaction=compaction)
    body = Body.of_chains(chains, law, safety=0.8 / halving)
    body.velocity[:5] = [0.0, sideways, -1.0]
    energies, momentum = [], []
    for steps in (1, 1500 * halving):
        body.step(steps)
        momentum.append(body.model.mass @ body.velocity)
        energies.append(body.energies())
    return body, energies, np.array(momentum)


def impact() -> list[Row]:
    """Two free bodies of mass 1 : 3 meet elastically: v1 = -v / 2, v2 = v / 2, momentum and energy stay.

    Newton (1687); Goldsmith (1960), Impact, chapter 1. Contact 30 times slower than the yarns' bending, so that its
    square, 1e-3, stays in vibration; momentum to rounding. Energy to dt^2, less when the touch is not at a step: its
    order scatters between 1 and 2. The second impact slides with mu = 0.3.
    """
    errors = []
    for halving in (1, 2, 4):
        body, energies, momentum = struck(halving, 0.0)
        before, after = (e["kinetic"] + e["internal"] + e["contact"] for e in energies)
        errors.append(after / before - 1.0)
    mass = body.model.mass
    mean = [float(mass[s] @ body.velocity[s, 2] / mass[s].sum()) for s in (slice(0, 5), slice(5, 10))]
    _, rubbed, _ = struck(4, 0.3, sideways=2.0)
    lost = (rubbed[1]["friction"] + rubbed[1]["contact_damping"]) / rubbed[0]["kinetic"]
    case, source, mesh = "elastic impact", "Goldsmith 1960", "dt, dt/2, dt/4"
    change = float(np.abs(momentum[1] - momentum[0]).max() / np.abs(momentum[0]).max())
    return [
        Row(case, source, "velocity of the light yarn [mm/ms]", 0.5, mean[0], "dt/4", None),
        Row(case, source, "velocity of the heavy yarn [mm/ms]", -0.5, mean[1], "dt/4", None),
        Row(case, source, "change of momentum [-]", 0.0, change, "dt/4", None),
        Row(case, source, "change of energy [-]", 0.0, errors[-1], mesh, order(errors), tuple(abs(e) for e in errors)),
        Row(
            f"impact with friction, {100.0 * lost:.0f} % lost", "balance", "change of energy [-]", 0.0,
            (rubbed[1]["balance"] - rubbed[0]["balance"]) / rubbed[0]["kinetic"], "dt/4", None,
        ),
    ]  # fmt: skip


def rows() -> list[Row]:
    """All contact cases of yarns."""
    return [
        crossing(0.3, 90.0),
        crossing(0.1, 60.0),
        *capstan(),
        wrapped(0.2),
        wrapped(0.3),
        wrapped(0.3, drum=0.1),
        *incline(),
        *impact(),
    ]
