"""Macro material card: tension, shear and bending from meso simulations, and the fabric file that holds it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray

from knittest.base.errors import NumericalError
from knittest.base.files import write_atomic
from knittest.config.fabric import Direction, Fabric
from knittest.config.laws import ELASTIC
from knittest.config.run import Run
from knittest.config.yaml_writer import dump_mapping
from knittest.experiment.biaxial_table import COLUMNS
from knittest.experiment.curves import FORCE_PER_WIDTH, START
from knittest.export.lock import DATA_FOLDER, copy_into_run
from knittest.kernels.biaxial import sample_table
from knittest.laboratory.biaxial.config import BiaxialRun
from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.picture_frame.shear_law import FRAME_ANGLE, NORMALISED, homogenised_law
from knittest.laboratory.tensile.config import TensileRun
from knittest.materials.biaxial import SLACK
from knittest.materials.biaxial_table import BiaxialTable
from knittest.materials.energy_fit import NoConvexEnergyError, fit_energy
from knittest.materials.heavy_elastica import stiffness_of
from knittest.materials.trellis import ANGLE
from knittest.studies.homogenise.plan import (
    REPEATED,
    PlannedTest,
    inlay_strain,
    overhang,
    strains_at_end,
    width,
)

Array = NDArray[np.float64]

#: points of a tension curve between the origin and the largest force
POINTS = 40
#: strain over the largest one of its direction below which a table may have too few rows between its paths
NEAR_ZERO = 0.1
#: smallest tangent of a tension curve, as a share of its secant: shell elements need one, breaking yarns have none
LEAST_TANGENT = 0.01
#: rows of a path of both strains, and intervals of the table from 0 to its highest strains
PATH_ROWS, GRID = 81, 24
#: the same intervals of yarns with a soft shell: the table ends up to one interval before the free contraction does
SOFT_GRID = 48
#: share of the planned strain by which a path that ends early is shorter
AT_THE_END = 1e-3
#: share of the largest strain at the ends of all paths from which on the end of one path is about the same
SAME_END = 0.95
#: largest fracture strain [%] of a card, of directions in which nothing fails
LARGEST_FRACTURE = 50.0
#: least bending stiffness of a card [N mm]: slack loops bend without any moment, shells cannot
LEAST_BENDING = 1e-3
#: fewest rows of a run's curve up to the largest force
FEWEST_ROWS = 2 * POINTS


def read_columns(folder: Path, x: str, y: str) -> tuple[Array, Array]:
    """Columns ``x`` and ``y`` of curve.csv in the run ``folder``, of the first loading only."""
    import pandas as pd

    table = pd.read_csv(folder / "curve.csv", comment="#")
    along, force = table[x].to_numpy(float), table[y].to_numpy(float)
    first = np.append(True, along[1:] > np.maximum.accumulate(along)[:-1])
    return along[first], force[first]


def tension_curve(strain: Array, force: Array) -> tuple[Array, Array]:
    """Strain [%] and force [N] from the origin to the largest force, from those of a strip, (n,).

    The forces are means over equal steps of strain with the least change (isotonic regression) for which no tangent is
    below :data:`LEAST_TANGENT`; the end point is that of the run. Raises :class:`NumericalError` for too few rows.
    """
    from scipy.optimize import isotonic_regression

    end = int(np.argmax(force)) + 1
    strain, force = strain[:end], force[:end]
    if len(strain) < FEWEST_ROWS:
        raise NumericalError(f"{len(strain)} rows up to the largest force; expected at least {FEWEST_ROWS}")
    last, peak = float(strain[-1]), float(force[-1])
    step = np.minimum((POINTS * strain / last).astype(int), POINTS - 1)
    inner = [k for k in range(1, POINTS) if np.any(step == k)]
    along = np.array([strain[step == k].mean() for k in inner])
    mean = np.array([force[step == k].mean() for k in inner])
    least = LEAST_TANGENT * peak / last
    rising = isotonic_regression(mean - least * along).x + least * along
    rising = np.clip(rising, least * along, peak - least * (last - along))
    return np.concatenate([[0.0], along, [last]]), np.concatenate([[0.0], rising, [peak]])


@dataclass(frozen=True)
class FinishedTest:
    """Finished test: its run, folder, results and key."""

    run: Run
    folder: Path
    results: Mapping[str, float]
    key: str


class NoYarnFailureError(NumericalError):
    """The path ended before a yarn failed."""


def tension_to_peak(test: FinishedTest) -> tuple[Array, Array]:
    """Strain [%] and force per width [N/mm] up to the largest force, (n,)."""
    cell = isinstance(test.run, CellRun)
    column = f"{test.run.rig.path}_n_per_mm" if isinstance(test.run, CellRun) else "force_n"
    strain, force = read_columns(test.folder, "strain_pct", column)
    end = int(np.argmax(force)) + 1
    return strain[:end], force[:end] if cell else force[:end] / width(test.run)


def tension_of(test: FinishedTest) -> tuple[Array, Array]:
    """Tension curve of the macro model; raises :class:`NoYarnFailureError` if no yarn of a cell failed."""
    run = test.run
    if isinstance(run, CellRun) and "cell_fracture_strain_pct" not in test.results:
        limit = f"rig.max_strain = {run.rig.max_strain:g} %"
        raise NoYarnFailureError(f"path {run.rig.path}: no yarn failed up to {limit}: increase it")
    return tension_curve(*tension_to_peak(test))


def normalised_shear_force(test: FinishedTest) -> tuple[Array, Array]:
    """Shear angle [deg] and normalised force [N/mm], (n,)."""
    if not isinstance(test.run, CellRun):
        return read_columns(test.folder, FRAME_ANGLE, NORMALISED)
    angle, force = read_columns(test.folder, "shear_angle_deg", "conjugate_force")
    return angle, force / np.cos(np.deg2rad(angle))


def shear_law(test: FinishedTest) -> tuple[Array, Array]:
    """Shear law of the macro model: of a frame after its start-up; of a cell, which has none, from 0 on."""
    return homogenised_law(*normalised_shear_force(test), 0.0 if isinstance(test.run, CellRun) else START)


def bending_stiffness(test: FinishedTest) -> float:
    """Bending stiffness per width [N mm]; of a strip that of the heavy elastica with the same chord angle."""
    run = test.run
    if isinstance(run, CellRun):
        found = test.results["cell_bending_stiffness_n_mm"]
        return max(found, LEAST_BENDING) if run.is_relaxed else found
    assert isinstance(run, CantileverRun)
    weight = run.fabric.area_mass_g_per_mm2 * run.rig.gravity_mm_per_ms2
    return stiffness_of(test.results["chord_angle_deg"], overhang(run), weight)


def strain_path(test: FinishedTest) -> tuple[Array, Array]:
    """Strains [-] and forces per width [N/mm] of warp and weft along a path of both strains, (n, 2) each."""
    share, warp = read_columns(test.folder, "path_pct", "warp_n_per_mm")
    _, weft = read_columns(test.folder, "path_pct", "weft_n_per_mm")
    if isinstance(test.run, CellRun) and test.run.is_relaxed:  # it starts at rest, before its first row
        share, warp, weft = (np.append(0.0, values) for values in (share, warp, weft))
    return 0.01 * share[:, None] * np.array(strains_at_end(test.run)), np.column_stack([warp, weft])


def biaxial_forces(test: FinishedTest) -> tuple[Array, Array, Array]:
    """Larger strain [%], force per width [N/mm] of warp and of weft, (n,), along a path or in a biaxial test."""
    if isinstance(test.run, CellRun):
        strain, force = strain_path(test)
        return 100.0 * np.abs(strain).max(axis=1), force[:, 0], force[:, 1]
    assert isinstance(test.run, BiaxialRun)
    strain_pct, own = read_columns(test.folder, "strain_pct", "force_n_per_mm")
    _, other = read_columns(test.folder, "strain_pct", "cross_force_n_per_mm")
    strain_pct = strain_pct * max(1.0, test.run.rig.ratio)
    return (strain_pct, own, other) if test.run.rig.direction == "warp" else (strain_pct, other, own)


def reached_share(test: FinishedTest) -> float:
    """Share of its path that a cell has reached."""
    return 0.01 * float(read_columns(test.folder, "path_pct", "warp_n_per_mm")[0][-1])


#: largest force of a table over that of its paths
BEYOND_PATHS = 1.1
#: fall of a force between two rows of a table, over its largest one, from which on it is an overshoot
OVERSHOOT = 0.02
#: paths that a law of two strains may leave out, as loops on them jump from one state to another
MOST_LEFT_OUT = 2


class PathLaw(NamedTuple):
    """Table of the law of two strains, the deviation of the forces of its paths, and the paths that it leaves out."""

    table: BiaxialTable
    deviation: float
    left_out: tuple[int, ...]


def grid_of(fabric: Fabric) -> int:
    """Intervals of the table of the law of two strains of ``fabric``."""
    return SOFT_GRID if fabric.has_soft_yarns else GRID


def optional_paths(pieces: Sequence[PlannedTest]) -> list[int]:
    """Numbers of the paths that a law of two strains may leave out: those that the macro model does not repeat."""
    return [k for k, piece in enumerate(pieces) if piece.angle not in REPEATED]


def biaxial_table(paths: Sequence[tuple[Array, Array]], optional: Sequence[int] = (), grid: int = GRID) -> PathLaw:
    """Table of the energy that fits ``paths`` of rising angle best, inside them, with ``grid`` intervals.

    Each path has strains [-] and forces per width [N/mm] of warp and weft, (n, 2) each. Where no convex energy has all
    their forces, those ``optional`` paths are left out without which the others deviate least.
    """
    left_out: tuple[int, ...] = ()
    found = _try_fit(paths, left_out, grid)
    while isinstance(found, NoConvexEnergyError):
        candidates = [(*left_out, k) for k in optional if k not in left_out]
        if not candidates or len(left_out) == MOST_LEFT_OUT:
            raise found
        fits = {one: _try_fit(paths, one, grid) for one in candidates}
        left_out = min(candidates, key=lambda one: fits[one].deviation)
        found = fits[left_out]
    return found


def _try_fit(
    paths: Sequence[tuple[Array, Array]], left_out: tuple[int, ...], grid: int
) -> PathLaw | NoConvexEnergyError:
    """Law of the ``paths`` that are not ``left_out``, or the error that they have no convex energy."""
    try:
        table, deviation = _fit_table([path for k, path in enumerate(paths) if k not in left_out], grid)
    except NoConvexEnergyError as error:
        return error
    return PathLaw(table, deviation, left_out)


def _fit_table(paths: Sequence[tuple[Array, Array]], intervals: int) -> tuple[BiaxialTable, float]:
    """Table of the energy that fits ``paths`` best, with ``intervals``, and the deviation of their forces."""
    ends, strains, forces = [], [], []
    for strain, force in paths:
        even = np.linspace(0.0, 1.0, PATH_ROWS) * float(np.abs(strain).max())
        at = np.abs(strain).max(axis=1)
        strains.append(np.column_stack([np.interp(even, at, strain[:, i]) for i in range(2)]))
        forces.append(np.column_stack([np.interp(even, at, force[:, i]) for i in range(2)]))
        ends.append(strain[-1])
    forces = [force - forces[0][0] for force in forces]  # a relaxed cell is free of stress, up to its residual
    strain, corners = np.vstack(strains), np.array(ends)
    step = np.array([_last_strain(corners, i) for i in range(2)]) / intervals
    lines = [step[i] * np.arange(np.ceil(strain[:, i].min() / step[i] - 1e-9), intervals + 1) for i in range(2)]
    grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    found = np.full(grid.shape, np.nan)
    known = _is_between(grid, corners)
    law, deviation = fit_energy(strain, np.vstack(forces), "paths of the cell")
    found[known] = sample_table(grid[known], law)[:, :2]
    # the straight line between the ends of two paths may lie beyond the strains where loops lock
    found[(np.abs(found) > BEYOND_PATHS * np.abs(np.vstack(forces)).max(axis=0)).any(axis=-1)] = np.nan
    found[_overshoots(grid, found)] = np.nan
    found[np.abs(grid).max(axis=-1) == 0.0] = 0.0
    ends = [_last_contraction(lines[i], np.moveaxis(found[..., 1 - i], i, 0)) for i in range(2)]
    return BiaxialTable(lines[0][: ends[0]], lines[1][: ends[1]], found[: ends[0], : ends[1]]), deviation


def _last_strain(ends: Array, direction: int) -> float:
    """Largest strain of ``direction`` at the ``ends`` (n, 2) of the paths; that of the path that holds the other one if
    it is about the same, as that of inlays is.
    """
    largest, held = float(ends[:, direction].max()), ends[np.abs(ends[:, 1 - direction]) < 1e-12, direction]
    return float(held.max()) if len(held) and held.max() > SAME_END * largest else largest


def _last_contraction(along: Array, cross: Array) -> int:
    """Number of strains ``along`` a direction up to which the paths reach the free contraction of strips: the ``cross``
    forces (n, m), those of the other direction, then include one that pushes, or hardly any.

    Near zero strain, between the paths, the table may have too few rows to show it. Beyond, there are no gaps.
    """
    slack = SLACK * float(np.nanmax(np.abs(cross)))
    reached = (along <= 0.0) | (np.fmin.reduce(cross, axis=1) <= slack)
    gaps = np.flatnonzero(~reached & (along > NEAR_ZERO * along[-1]))
    return 1 + int(np.flatnonzero(reached[: gaps[0]] if len(gaps) else reached).max())


def _overshoots(grid: Array, force: Array) -> NDArray[np.bool_]:
    """Tell where the own force falls to the next strain of ``grid`` (n, m, 2), and beyond, in the corner of the table:
    the spline of an energy may overshoot where loops are piled up.
    """
    found = np.zeros(force.shape[:-1], bool)
    for axis in range(2):
        own = force[..., axis]
        first = (slice(None),) * axis + (slice(None, -1),)
        falls = np.diff(own, axis=axis) < -OVERSHOOT * float(np.nanmax(np.abs(own)))
        for corner in grid[first][falls]:
            found |= (grid * np.sign(corner) >= np.abs(corner) - 1e-12).all(axis=-1)
    return found


def _is_between(grid: Array, corners: Array) -> NDArray[np.bool_]:
    """Tell which strains (..., 2) are in the triangles of zero strain and two neighbours of ``corners`` (n, 2)."""
    inside = np.zeros(grid.shape[:-1], bool)
    for a, b in pairwise(corners):
        share = grid @ np.linalg.inv(np.stack([a, b]))
        inside |= (share >= -1e-9).all(axis=-1) & (share.sum(axis=-1) <= 1.0 + 1e-9)
    # a row and its neighbours of less pull: no gaps
    for axis in range(2):
        pulled = np.abs(grid[..., axis]) * (grid[..., axis] >= -1e-12)
        outside = np.logical_or.accumulate((pulled > 0.0) & ~inside & (grid[..., 1 - axis] >= 0.0), axis=axis)
        inside &= ~outside
    return inside


FABRIC = "fabric.yaml"
#: paths of both strains that pull one direction and hold the other
ALONG: dict[Direction, PlannedTest] = {
    "warp": PlannedTest("biaxial", angle=0.0), "weft": PlannedTest("biaxial", angle=90.0),
}  # fmt: skip
#: characters of a fabric's name, and what is added to it
LONGEST_NAME, SUFFIX = 40, "-homogenised"
DIRECTIONS: tuple[Direction, ...] = get_args(Direction)


@dataclass(frozen=True)
class MacroCard:
    """Macro material card from ``tests``: tension curves, strain [%] and force per width [N/mm], by direction, or the
    ``biaxial`` table of both; shear law, angle [deg] and conjugate force [N/mm]; bending stiffness [N mm] by direction.
    """

    tension: dict[Direction, tuple[Array, Array]]
    shear: tuple[Array, Array]
    bending: dict[Direction, float]
    tests: dict[PlannedTest, FinishedTest]
    biaxial: BiaxialTable | None = None
    #: largest deviation of the forces of the paths from those of an energy, over the largest force
    deviation: float = 0.0
    #: paths that the table leaves out
    left_out: tuple[int, ...] = ()


def card_of(tests: dict[PlannedTest, FinishedTest]) -> MacroCard:
    """Derive the card from finished ``tests``; raises :class:`NumericalError` for a curve of too few points, and
    :class:`InputError` for forces over two strains that no energy gives.
    """
    tension: dict[Direction, tuple[Array, Array]] = {}
    bending: dict[Direction, float] = {}
    shear: tuple[Array, Array] = (np.zeros(1), np.zeros(1))
    paths: list[FinishedTest] = []
    for piece, test in tests.items():
        if piece.kind == "picture-frame":
            shear = shear_law(test)
        elif piece.angle is not None:
            paths.append(test)
        elif piece.direction and piece.kind == "tensile":
            tension[piece.direction] = tension_of(test)
        elif piece.direction:
            bending[piece.direction] = bending_stiffness(test)
    if paths:
        optional = optional_paths([piece for piece in tests if piece.angle is not None])
        law = biaxial_table([strain_path(test) for test in paths], optional, grid_of(paths[0].run.fabric))
        return MacroCard(tension, shear, bending, tests, *law)
    return MacroCard(tension, shear, bending, tests)


def write_card(card: MacroCard, folder: Path, command: str) -> Path:
    """Write the fabric file and its curves to ``folder``; returns its path. Raises :class:`ResourceError`."""
    data = folder / DATA_FOLDER
    data.mkdir(exist_ok=True)
    run = next(iter(card.tests.values())).run
    kind = f"# kind: simulated\n# fabric: {_fabric_name(run)}\n"
    for direction, (strain, force) in card.tension.items():
        pulled_run = card.tests[PlannedTest("tensile", direction)].run
        lines = [f"source: {_source(card, 'tensile', direction)}", "test: tensile", f"direction: {direction}"]
        if isinstance(pulled_run, TensileRun):
            lines.append(f"strip_width_mm: {width(pulled_run):.6g}")
            lines.append(f"gauge_length_mm: {pulled_run.rig.gauge_length:g}")
        lines += [f"fracture_strain_pct: {strain[-1]:.6g}", f"peak_force_n_per_mm: {force[-1]:.6g}"]
        head = kind + "".join(f"# {line}\n" for line in lines) + f"strain_pct,{FORCE_PER_WIDTH}\n"
        write_atomic(data / f"tension-{direction}.csv", head + _csv_rows(strain, force))
    if card.biaxial is not None:
        strain, force = card.biaxial.samples
        head = f"{kind}# source: {_source(card, 'biaxial')}\n{','.join(COLUMNS)}\n"
        rows = np.column_stack([100.0 * strain, force])
        write_atomic(data / "biaxial.csv", head + "".join(",".join(f"{v:.7g}" for v in row) + "\n" for row in rows))
    head = f"{kind}# source: {_source(card, 'picture-frame')}\n{ANGLE},shear_force_n_per_mm\n"
    write_atomic(data / "shear.csv", head + _csv_rows(*card.shear))
    head = f"# Fabric {run.fabric.name} with a macro material card from meso simulations, made by\n#   {command}\n"
    write_atomic(folder / FABRIC, head + dump_mapping(_fabric(card, run, folder), ("fabric",)))
    return folder / FABRIC


def card_numbers(card: MacroCard) -> dict[str, float]:
    """Single numbers of the card by their field, and the ends of its curves."""
    found: dict[str, float] = {}
    if card.biaxial is not None:
        found["biaxial, largest warp strain [%]"] = 100.0 * float(card.biaxial.warp[-1])
        found["biaxial, largest weft strain [%]"] = 100.0 * float(card.biaxial.weft[-1])
        found["biaxial, paths left out"] = float(len(card.left_out))
        found["biaxial, deviation from an energy beyond 3 % of the strain [%]"] = 100.0 * card.deviation
    for direction in DIRECTIONS:
        if direction in card.tension:
            strain, force = card.tension[direction]
            found[f"fracture_strain.{direction} [%]"] = float(strain[-1])
            found[f"tension.{direction}, peak [N/mm]"] = float(force[-1])
        found[f"bending_stiffness.{direction} [N mm]"] = card.bending[direction]
    found["shear, last angle [deg]"] = float(card.shear[0][-1])
    found["shear, last force [N/mm]"] = float(card.shear[1][-1])
    return found


def _fabric_name(run: Run) -> str:
    return run.fabric.name[: LONGEST_NAME - len(SUFFIX)] + SUFFIX


def _fabric(card: MacroCard, run: Run, folder: Path) -> dict[str, Any]:
    """Fields of the fabric of ``run`` with the card as its macro material."""
    data: dict[str, Any] = run.fabric.model_dump(mode="json", exclude_none=True)
    data["name"] = _fabric_name(run)
    data["title"] = f"{run.fabric.title}; macro material card homogenised from yarns".removeprefix("; ")
    macro = data["macro"]
    friction = ELASTIC if run.fabric.macro.shear is None else run.fabric.macro.shear.friction_share
    if card.biaxial is None:
        macro["tension"] = {d: f"{DATA_FOLDER}/tension-{d}.csv" for d in DIRECTIONS}
        ends = {d: float(card.tension[d][0][-1]) for d in DIRECTIONS}
        macro["fracture_strain"] = {d: _derived_quantity(end, _source(card, "tensile", d)) for d, end in ends.items()}
    else:
        for name in ("tension", "fracture_strain", "poisson"):
            macro.pop(name, None)
        if not run.fabric.has_inlays_both_ways:
            last = {d: 100.0 * strain_path(card.tests[piece])[0][-1] for d, piece in ALONG.items()}
            strains = {d: float(last[d][i]) for i, d in enumerate(DIRECTIONS) if inlays_fail(run.fabric, d, last[d][i])}
            macro |= coupled_fracture(strains, _source(card, "biaxial"))
        macro["biaxial"] = {
            "curve": f"{DATA_FOLDER}/biaxial.csv", "source": "derived", "ref": _source(card, "biaxial"),
        }  # fmt: skip
    macro["bending_stiffness"] = {
        d: bending_quantity(card.bending[d], _source(card, "cantilever", d)) for d in DIRECTIONS
    }
    macro["shear"] = {
        "kind": "table", "curve": f"{DATA_FOLDER}/shear.csv", "source": "derived",
        "ref": _source(card, "picture-frame"), "friction_share": friction.model_dump(mode="json", exclude_none=True),
    }  # fmt: skip
    if data.get("experiment"):
        data["experiment"] = copy_into_run(data["experiment"], folder, "experiment")
    return data


def inlays_fail(fabric: Fabric, direction: Direction, strain: float) -> bool:
    """Tell whether a path that ends at ``strain`` [%] along ``direction`` ends because its inlays fail."""
    most = inlay_strain(fabric, direction)
    return bool(fabric.inlays_along(direction)) and strain < (1.0 - AT_THE_END) * most


def coupled_fracture(strains: Mapping[Direction, float], ref: str) -> dict[str, Any]:
    """Field fracture_strain of a law of two strains, from the ``strains`` [%] at which the inlays of a direction fail;
    empty where none do. Loops do not fail.
    """
    if not strains:
        return {}
    loops = {"value": LARGEST_FRACTURE, "source": "assumed", "ref": "nothing fails up to the end of the paths"}
    return {"fracture_strain": {d: _derived_quantity(strains[d], ref) if d in strains else loops for d in DIRECTIONS}}


def bending_quantity(value: float, ref: str) -> dict[str, Any]:
    """Bending stiffness ``value`` [N mm] with its source ``ref``; assumed where it is the least one of a card."""
    made = _derived_quantity(value, ref)
    if value > LEAST_BENDING:
        return made
    return made | {"source": "assumed", "ref": f"{ref}; the least of a card, as slack loops bend with less"}


def _derived_quantity(value: float, ref: str) -> dict[str, Any]:
    return {"value": float(f"{value:.6g}"), "source": "derived", "ref": ref}


def _source(card: MacroCard, kind: str, direction: Direction | None = None) -> str:
    """Source of a number: its run."""
    piece = next(p for p in card.tests if (p.kind, p.direction) == (kind, direction))
    test = card.tests[piece]
    run = test.run
    of = f"{piece.name}, meso model"
    if isinstance(run, CellRun):
        equal = ", all yarns of equal strength" if kind == "tensile" else ""
        if piece.angle is not None:
            return (
                f"homogenised from {sum(p.angle is not None for p in card.tests)} paths of both strains of a periodic "
                f"cell, the first trials/{test.key}, {run.fabric.name}, {run.parameters}, preset {run.model.preset}"
            )
        of = f"path {run.rig.path} of a periodic cell{equal}"
    return (
        f"homogenised from run trials/{test.key}: {of}, {run.fabric.name}, {run.parameters}, preset "
        f"{run.model.preset}, seed {run.variability.seed}"
    )


def _csv_rows(x: Array, y: Array) -> str:
    return "".join(f"{a:.6g},{b:.6g}\n" for a, b in zip(x, y, strict=True))
