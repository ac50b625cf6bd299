"""A made-up strip with the real geometry (harmonic loops, wavy inlays) for the tests of the export layer."""

import numpy as np

from knittest.base.history import Cost, Frame, History, Mesh, Quality

WALE, COURSE = 100 / 28, 100 / 41
LOOP = {"H": 3.6707, "zs": -0.6414, "zn": -0.0317, "zl": 1.3655, "A": 0.729417}


def loop_curve(points: int) -> np.ndarray:
    """One loop of variant 2, (points + 1, 3), from sinker arc to sinker arc [mm]."""
    theta = np.linspace(0, 2 * np.pi, points + 1)
    z1 = (LOOP["zs"] - LOOP["zn"]) / 2
    z2 = ((LOOP["zs"] + LOOP["zn"]) / 2 - LOOP["zl"]) / 2
    x = WALE * (theta - np.pi) / (2 * np.pi) + LOOP["A"] * np.sin(2 * theta)
    y = -(LOOP["H"] / 2) * np.cos(theta)
    z = LOOP["zl"] + z2 + z1 * np.cos(theta) + z2 * np.cos(2 * theta)
    return np.stack([x, y, z], axis=1)


def strip(wales: int, courses: int, points: int = 24, wave: int = 8) -> tuple[Mesh, np.ndarray]:
    """Mesh and positions [mm] of a warp strip: ``wales`` x ``courses`` loops with all its inlays."""
    chains: list[tuple[int, float, np.ndarray]] = []
    for wale in range(wales):
        y = np.linspace(0, courses * COURSE, courses * wave + 1)
        z = -0.08 * np.cos(2 * np.pi * y / COURSE)
        chains.append((0, 0.375, np.stack([np.full_like(y, wale * WALE), y, z], axis=1)))
    for course in range(courses):
        x = np.linspace(-WALE, wales * WALE, (wales + 1) * wave + 1)
        y = np.full_like(x, (course + 0.5) * COURSE)
        chains.append((1, 0.375, np.stack([x, y, 0.75 + 0.08 * np.cos(2 * np.pi * x / WALE)], axis=1)))
        corners = np.array([[(wale + 0.5) * WALE, (course + 0.4) * COURSE, 0.0] for wale in range(wales - 1)])
        loops = corners[:, None, :] + loop_curve(points)[None, :-1, :]
        chains.append((2, 0.25, loops.reshape(-1, 3)))
    cells, part, yarn, radius, nodes, first = [], [], [], [], [], 0
    for number, (system, r, points_) in enumerate(chains):
        n = len(points_) - 1
        cells.append(first + np.stack([np.arange(n), np.arange(1, n + 1)], axis=1))
        part.append(np.full(n, system))
        yarn.append(np.full(n, number))
        radius.append(np.full(n, r))
        nodes.append(points_)
        first += n + 1
    mesh = Mesh(
        kind="beams",
        cells=np.concatenate(cells),
        part=np.concatenate(part),
        part_names=("warp", "weft", "knit"),
        yarn=np.concatenate(yarn),
        radius=np.concatenate(radius),
    )
    return mesh, np.concatenate(nodes)


def beam_history(wales: int = 4, courses: int = 6, points: int = 24) -> History:
    """Unloaded, near the peak, and broken: every warp yarn has one failed element and a gap of some millimetres."""
    mesh, reference = strip(wales, courses, points)
    generator = np.random.default_rng(7)
    alive = np.ones(len(mesh.cells))
    none = np.zeros(len(mesh.cells))
    warp = mesh.part == 0
    tension = np.where(warp, 380 + 20 * generator.standard_normal(len(warp)), 0.0)
    tension += np.where(mesh.part == 2, 3 + 2 * generator.standard_normal(len(warp)), 0.0)
    stretched = reference * [0.995, 1.015, 1.0]
    broken_alive, broken = alive.copy(), reference * [1.0, 1.03, 1.0]
    for number in range(wales):
        elements = np.flatnonzero(warp & (mesh.yarn == number))
        at = int(len(elements) * generator.uniform(0.45, 0.6))
        broken_alive[elements[at]] = 0.0
        nodes = mesh.cells[elements[at + 1 :]].ravel()
        broken[np.unique(nodes), 1] += 2.0
    states = [
        (0.0, 0.0, 0.0, reference, none, alive),
        (2.0, 0.015, 380.0 * wales, stretched, tension, alive),
        (2.6, 0.03, 12.0, broken, 0.03 * tension * broken_alive, broken_alive),
    ]
    frames = [
        Frame(
            time, 100.0 * strain, force, position, {"axial_force": load, "axial_strain": load / 46500, "alive": living}
        )
        for time, strain, force, position, load, living in states
    ]
    history = History(mesh, curve(380.0 * wales), energies(("warp", "weft", "knit")), frames, first_failure=160)
    return history


def shell_history(columns: int = 4, rows: int = 10) -> History:
    """A shell strip pulled along x, one row of elements deleted in the last frame."""
    x, y = np.meshgrid(np.arange(rows + 1) * 5.0, np.arange(columns + 1) * 5.0, indexing="ij")
    reference = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    corner = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)[None, :]).ravel()
    cells = np.stack([corner, corner + columns + 1, corner + columns + 2, corner + 1], axis=1)
    n = len(cells)
    mesh = Mesh("shells", cells, np.zeros(n, int), ("fabric",), np.full(n, -1), np.full(n, 1.1))
    alive = np.ones(n)
    alive[(rows // 2) * columns : (rows // 2 + 1) * columns] = 0.0
    load = np.full(n, 110.0) + np.arange(n)
    states = [(0.0, 0.0, 0.0 * load, np.ones(n)), (2.0, 5800.0, load, np.ones(n)), (2.6, 0.0, 0.02 * load, alive)]
    frames = [
        Frame(
            time,
            0.8 * time,
            force,
            reference * [1 + 0.008 * time, 1.0, 1.0],
            {"force_warp": field, "force_weft": 0.1 * field, "strain_warp": field / 1e4, "alive": living},
        )
        for time, force, field, living in states
    ]
    return History(mesh, curve(5800.0), energies(("fabric",)), frames, first_failure=160)


def curve(peak: float) -> dict[str, np.ndarray]:
    """A force-strain curve with a toe, its ``peak`` [N] at 1.6 % and a drop."""
    strain = np.linspace(0, 2.2, 221)
    force = np.where(strain <= 1.6, peak * (strain / 1.6) ** 1.6, peak * np.exp(-((strain - 1.6) / 0.08)))
    return {
        "time_ms": strain * 2,
        "displacement_mm": strain * 2,
        "strain_pct": strain,
        "force_n": force,
        "force_fixed_n": force * 0.99,
        "failed_warp": np.where(strain > 1.6, 14.0, 0.0),
    }


def energies(parts: tuple[str, ...]) -> dict[str, np.ndarray]:
    """Energies [mJ] that add up to the external work but for a small error."""
    time = np.linspace(0, 4.4, 221)
    work = 9000 * np.minimum(time / 3.2, 1.0) ** 2.6
    table = {"time_ms": time, "kinetic_mj": 0.004 * work + np.where(time > 3.2, 900.0, 0.5)}
    for number, part in enumerate(parts):
        table[f"internal_{part}_mj"] = work * (0.85, 0.04, 0.03)[number] * np.where(time > 3.2, 0.15, 1.0)
    zero = np.zeros_like(time)
    table |= {"hourglass_mj": zero, "contact_mj": 0.01 * work, "friction_mj": 0.03 * work, "damping_mj": 0.02 * work}
    table |= {"eroded_mj": np.where(time > 3.2, 0.7 * work, 0.0), "external_mj": work, "balance_error_mj": 0.001 * work}
    table |= {"kinetic_ratio": table["kinetic_mj"] / (work + 1.0), "energy_error": np.full_like(time, 0.001)}
    return table


def quality(failures: tuple[str, ...] = ()) -> Quality:
    """Gates of a good run, or of one that fails ``failures``."""
    return Quality(0.008, 0.0012, 0.031, 0.012, 0.0, not failures, failures)


def cost() -> Cost:
    """Plausible numbers."""
    return Cost(21.5, 40.1, 12.0, 3.0, 48000, 35876, 8.0e7, 2, 0.112)
