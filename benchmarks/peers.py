"""Element-steps a second of PyElastica and MuJoCo beside knittest, in one run, by turns, on one thread.

    pip install pyelastica mujoco
    python benchmarks/peers.py

Two cases: 100 free rods of 100 elements, and a grid of 10 by 10 crossed rods of 100 elements that overlap by 0.1 mm
at 100 crossings, so softly that they stay together. Rods are 1 mm thick, of 60 GPa and 2.5 g/cm3, elements
1 mm long. The steps are shown but not compared: ours is 0.9 of the critical one, those of PyElastica and MuJoCo a third
and a tenth of the time of a wave along an element, which nobody has tuned. A code that is not installed is named.
Times are processor time.
"""

import argparse
import importlib.util
import statistics
import time
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from knittest.models.yarn_model import YarnModel
from knittest.pose import Body, Chain, YarnContact, round_section

RODS, ELEMENTS, GRID, PITCH = 100, 100, 10, 10.0
DIAMETER, MODULUS, DENSITY = 1.0, 60e3, 2.5e-3
#: depth to which crossed rods overlap at the start [mm]; stiffness [N/mm] of contact, soft, so that they stay together,
#: and what moves points of MuJoCo apart as fast, over their mass [1/ms2]
DEPTH, STIFFNESS, PUSH = 0.1, 0.01, 0.5
FRICTION = 0.3
#: speed [mm/ms] at which free rods start to bend, along z as a half wave
SPEED = 0.1
#: least processor time [s] of a turn
TURN = 0.5

#: makes steps, the length of one [us], and counts places where rods touch now
Case = tuple[Callable[[int], None], float, Callable[[], int]]

LACKS = {
    "knittest": "nothing of the two cases: beams bend, twist and shear; contacts are found, tracked and rub",
    "PyElastica": "friction between rods; a search (every element of a pair of rods is held against every other)",
    "MuJoCo": "bending, twist and shear of these lines (ropes of springs); contacts are soft constraints",
}


def lines(crossed: bool) -> list[NDArray[np.float64]]:
    """Nodes (101, 3) [mm] of each rod: side by side, or half of a grid laid over the other half."""
    along = np.arange(ELEMENTS + 1.0)
    if not crossed:
        return [np.column_stack([along, np.full_like(along, 5.0 * k), 0.0 * along]) for k in range(RODS)]
    offset, level = PITCH * np.arange(GRID) + 5.3, 0.5 * (DIAMETER - DEPTH)
    first = [np.column_stack([along, np.full_like(along, at), np.full_like(along, level)]) for at in offset]
    return first + [np.column_stack([np.full_like(along, at), along, np.full_like(along, -level)]) for at in offset]


def ours(crossed: bool) -> Case:
    """Beam chains of knittest, with tracked contacts."""
    section = round_section(modulus=MODULUS, diameter=DIAMETER, density=DENSITY)
    contact = YarnContact(STIFFNESS, 0.5 * STIFFNESS, FRICTION) if crossed else None
    body = Body.of_chains([Chain(points, section) for points in lines(crossed)], contact, threads=1)
    if not crossed:
        body.model.nodes.velocity[2, : body.model.n_nodes] = np.tile(_push(), RODS)
    body.advance(20 * body.dt)
    model = body.model
    assert isinstance(model, YarnModel)
    return lambda steps: body.advance(steps * body.dt), 1e3 * body.dt, lambda: model.tracker.count


def _push() -> NDArray[np.float64]:
    return SPEED * np.sin(np.pi * np.arange(ELEMENTS + 1.0) / ELEMENTS)


def pyelastica(crossed: bool) -> Case:
    """Cosserat rods of PyElastica in one block, position Verlet at a third of an element's wave time."""
    import elastica as ea

    class World(ea.BaseSystemCollection, ea.Contact): ...  # type: ignore[misc]

    world, rods = World(), []
    for points in lines(crossed):
        direction = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])
        rod = ea.CosseratRod.straight_rod(
            ELEMENTS, points[0], direction, np.array([0.0, 0.0, 1.0]), float(ELEMENTS), 0.5 * DIAMETER, DENSITY,
            youngs_modulus=MODULUS, shear_modulus=MODULUS / 2.6,
        )  # fmt: skip
        rods.append(rod)
        world.append(rod)
        if not crossed:
            rod.velocity_collection[2] = _push()
    if crossed:
        for one in rods[:GRID]:
            for other in rods[GRID:]:
                world.detect_contact_between(one, other).using(ea.RodRodContact, k=STIFFNESS, nu=0.0)
    world.finalize()
    stepper, dt = ea.PositionVerlet(), np.float64(np.sqrt(DENSITY / MODULUS) / 3.0)

    def advance(steps: int) -> None:
        at = np.float64(0.0)
        for _ in range(steps):
            at = stepper.step(world, at, dt)

    def touching() -> int:
        gaps = [
            _gap(one.position_collection, other.position_collection) for one in rods[:GRID] for other in rods[GRID:]
        ]
        return sum(gap < DIAMETER for gap in gaps) if crossed else 0

    advance(2)
    return advance, 1e3 * float(dt), touching


def _gap(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Least height between nodes of two crossed rods (3, n), where their nodes are nearest in plan."""
    apart = np.linalg.norm(one[:2, :, None] - other[:2, None, :], axis=0)
    i, j = np.unravel_index(int(np.argmin(apart)), apart.shape)
    return float(abs(one[2, i] - other[2, j]))


def mujoco(crossed: bool) -> Case:
    """Flexes of dimension 1 of MuJoCo with elastic edges, with its collision and constraint solver."""
    import mujoco as mj

    step, mass = 0.1 * np.sqrt(DENSITY / MODULUS), DENSITY * 0.25 * np.pi * DIAMETER**2 * ELEMENTS
    flexes = []
    for k, points in enumerate(lines(crossed)):
        middle, along_y = points.mean(axis=0), crossed and k >= GRID
        flexes.append(
            f'<flexcomp name="r{k}" type="grid" count="{ELEMENTS + 1} 1 1" spacing="1 1 1" dim="1" '
            f'radius="{0.5 * DIAMETER}" mass="{mass}" pos="{middle[0]} {middle[1]} {middle[2]}" '
            f'euler="0 0 {90 if along_y else 0}"><contact selfcollide="none" contype="{int(crossed)}" '
            f'conaffinity="{int(crossed)}" condim="3" friction="{FRICTION}" solref="{-PUSH} {-PUSH}"/>'
            f'<edge stiffness="{MODULUS * 0.25 * np.pi * DIAMETER**2}" damping="0"/></flexcomp>'
        )
    option = f'<option timestep="{step}" gravity="0 0 0" integrator="Euler"/>'
    text = f'<mujoco>{option}<size memory="4G"/><worldbody>{"".join(flexes)}</worldbody></mujoco>'
    model = mj.MjModel.from_xml_string(text)
    data = mj.MjData(model)
    mj.mj_step(model, data, 2)
    return lambda steps: mj.mj_step(model, data, steps), 1e3 * step, lambda: int(data.ncon)


CODES: dict[str, tuple[str, Callable[[bool], Case]]] = {
    "knittest": ("knittest", ours),
    "PyElastica": ("elastica", pyelastica),
    "MuJoCo": ("mujoco", mujoco),
}


def _turn(advance: Callable[[int], None], steps: int) -> float:
    start = time.process_time()
    advance(steps)
    return time.process_time() - start


def _enough(advance: Callable[[int], None]) -> int:
    """Steps of a turn."""
    steps = 1
    while _turn(advance, steps) < TURN:
        steps *= 2
    return steps


def table(crossed: bool, turns: int) -> Iterator[str]:
    """Rows of one case; the codes by turns."""
    found = {name: make(crossed) for name, (module, make) in CODES.items() if importlib.util.find_spec(module)}
    count = (2 * GRID if crossed else RODS) * ELEMENTS
    steps = {name: _enough(case[0]) for name, case in found.items()}
    spent: dict[str, list[float]] = {name: [] for name in found}
    for _ in range(turns):
        for name, (advance, _, _) in found.items():
            spent[name].append(_turn(advance, steps[name]) / steps[name])
    case = "a grid of crossed rods" if crossed else "free rods"
    yield f"| {count:,} elements, {case} | touch | step [us] | M element-steps/s | lacks |"
    yield "|---|---|---|---|---|"
    for name, lacking in LACKS.items():
        if name not in found:
            yield f"| {name} | not installed | | | {lacking} |"
            continue
        _, step, touching = found[name]
        each = statistics.median(spent[name])
        yield f"| {name} | {touching()} | {step:.3g} | {1e-6 * count / each:.3g} | {lacking} |"


def main() -> None:
    """Print both tables and the versions."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--turns", type=int, default=5)
    asked = parser.parse_args()
    for crossed in (False, True):
        for line in table(crossed, asked.turns):
            print(line, flush=True)


if __name__ == "__main__":
    main()
