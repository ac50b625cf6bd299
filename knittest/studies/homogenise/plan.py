"""Tests of a homogenisation: five meso tests, or paths of a periodic cell, and the macro tests with the card."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import floor
from pathlib import Path
from typing import Literal

import numpy as np

from knittest.base.arrays import Array
from knittest.base.errors import InputError
from knittest.config.fabric import Direction, Fabric
from knittest.config.loading import resolve
from knittest.config.rigs import StripRig
from knittest.config.run import Run
from knittest.config.settings import Setting, parse_set
from knittest.config.structure import DIRECTIONS
from knittest.laboratory.cantilever.config import CantileverRun
from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.picture_frame.config import PictureFrameRun
from knittest.laboratory.strips import modelled_width
from knittest.laboratory.tensile.config import TensileRun

#: meso simulations of a card: tests of specimens, or paths of a periodic cell
Source = Literal["tests", "cell"]
#: least length of the strip of a cantilever over its overhang
LENGTH_FACTOR = 1.2


@dataclass(frozen=True)
class PlannedTest:
    """Test of the plan, along ``direction`` if it has one, or of both strains at an ``angle`` [deg] of their plane."""

    kind: str
    direction: Direction | None = None
    angle: float | None = None

    @property
    def name(self) -> str:
        """Name such as ``tensile warp``."""
        at = "" if self.angle is None else f"{self.angle:g} deg"
        return f"{self.kind} {self.direction or ''}{at}".strip()


PLANNED_TESTS = (
    PlannedTest("tensile", "warp"), PlannedTest("tensile", "weft"),
    PlannedTest("picture-frame"), PlannedTest("cantilever", "warp"),
    PlannedTest("cantilever", "weft"),
)  # fmt: skip
#: paths of the law of two strains: 0 deg is the warp, 90 deg the weft, each strain over the largest one of its
#: direction; before and after, the other direction contracts. Those that the macro model repeats
PATH_ANGLES, REPEATED = (-45.0, -22.5, 0.0, 22.5, 45.0, 67.5, 90.0, 112.5, 135.0), (0.0, 45.0, 90.0)
#: and the share of each path that they repeat: beyond it, corners of the table are missing
REPEATED_SHARE = 0.9
#: further paths of fabrics without inlays in a direction, which contract by more than they stretch
KNIT_ANGLES = (-60.0, *PATH_ANGLES, 150.0)
#: the same of yarns with a soft shell, which contract by half before they lock; close about the free contraction of the
#: weft
SOFT_ANGLES = tuple(sorted((*KNIT_ANGLES, -11.25, 101.25, 118.0, 123.75)))


def coupled_tests(angles: Sequence[float]) -> tuple[PlannedTest, ...]:
    """Tests of a card with a law of two strains, from paths at ``angles`` [deg]."""
    return (*(PlannedTest("biaxial", angle=angle) for angle in angles), *PLANNED_TESTS[2:])


@dataclass(frozen=True)
class Request:
    """Fabric to homogenise and settings of its meso model, as options of the command.

    ``sets`` are ``key.path=value`` for all tests, or ``TEST.key.path=value`` for those of a kind.
    """

    variant: str | None = None
    fabric: Path | None = None
    parameters: str | None = None
    preset: str | None = None
    seed: int | None = None
    sets: tuple[str, ...] = ()
    accept_limits: bool = False
    source: Source = "tests"
    coupled: bool = False


def is_coupled(request: Request) -> bool:
    """Tell whether the card has one law of both directions, as fabrics without inlays in a direction need."""
    return request.coupled or bool(_knit_angles(request))


def angles_without_inlays(fabric: Fabric) -> tuple[float, ...]:
    """Angles [deg] of the paths of a ``fabric`` without inlays in one direction; none with inlays both ways."""
    if fabric.has_inlays_both_ways:
        return ()
    return SOFT_ANGLES if fabric.has_soft_yarns else KNIT_ANGLES


@cache
def _knit_angles(request: Request) -> tuple[float, ...]:
    """Angles of :func:`angles_without_inlays` of the fabric of ``request``."""
    return angles_without_inlays(resolve_meso_run(request, "cell", None, []).fabric)


def planned_tests(request: Request) -> tuple[PlannedTest, ...]:
    """Tests of ``request``; raises :class:`InputError` for one law of both directions from tests of specimens."""
    if not is_coupled(request):
        return PLANNED_TESTS
    if request.source != "cell":
        raise InputError(
            "the card has one law of both directions (--coupled, or a fabric without inlays in one direction), which "
            "needs paths of a cell: add --from cell"
        )
    return coupled_tests(_knit_angles(request) or PATH_ANGLES)


def meso_run(request: Request, piece: PlannedTest) -> Run:
    """Meso run of ``piece``; raises :class:`InputError` for invalid settings."""
    settings = settings_for(request.sets, piece)
    run = resolve_meso_run(request, piece.kind, piece.direction, settings)
    if run.variability.specimens > 1:
        raise InputError("variability.specimens: a card is made of single specimens: leave it at 1")
    if isinstance(run, CantileverRun):  # without loops it would hang at a chord of 41.5 deg
        fabric, along = run.fabric, run.rig.direction
        stiffness = fabric.yarn_bending_n_mm(along)
        overhang = run.rig.overhang or round(overhang_for_chord(stiffness, run), 1)
        length = max(run.rig.length, LENGTH_FACTOR * overhang)
        more = [
            command_setting("rig.mode", "angle"),
            command_setting("rig.overhang", overhang),
            command_setting("rig.length", length),
        ]
        run = resolve_meso_run(request, piece.kind, piece.direction, [*settings, *more])
    return run


def resolve_meso_run(request: Request, test: str, direction: Direction | None, sets: Sequence[Setting]) -> Run:
    """Meso run of ``test`` with the fabric and settings of ``request``."""
    return resolve(
        variant=request.variant, fabric=request.fabric, parameters=request.parameters, preset=request.preset,
        seed=request.seed, scale="meso", test=test, direction=direction, sets=sets,
        accept_limits=request.accept_limits,
    )  # fmt: skip


def overhang_for_chord(stiffness: float, run: CantileverRun) -> float:
    """Overhang [mm] of a chord of 41.5 deg for a ``stiffness`` B [N mm]: 2 (B / w)^(1/3), Eq. 2 of Pham et al."""
    weight = run.fabric.area_mass_g_per_mm2 * run.rig.gravity_mm_per_ms2
    return 2.0 * float((stiffness / weight) ** (1.0 / 3.0))


def macro_run(piece: PlannedTest, yarns: Run, card: Path, last_angle: float) -> Run:
    """Macro run of ``piece`` with the file ``card``, of the size of ``yarns``; a frame up to ``last_angle`` [deg]."""
    settings = list[Setting]()
    if isinstance(yarns, TensileRun):
        settings = [command_setting("rig.gauge_length", yarns.rig.gauge_length)]
    elif isinstance(yarns, CantileverRun):
        settings = [
            command_setting(f"rig.{name}", getattr(yarns.rig, name))
            for name in ("mode", "overhang", "length", "gravity")
        ]
    elif isinstance(yarns, PictureFrameRun):
        angle = min(yarns.rig.max_angle, _rounded_down(last_angle))
        settings = [command_setting("rig.side", yarns.rig.side), command_setting("rig.max_angle", angle)]
    if piece.direction:
        settings.append(command_setting("rig.width", width(yarns)))
    return resolve_macro_run(piece, yarns, card, settings)


def resolve_macro_run(piece: PlannedTest, yarns: Run, card: Path, settings: Sequence[Setting]) -> Run:
    """Macro run of ``piece`` with the fabric file ``card``, and preset and seed of ``yarns``."""
    return resolve(
        fabric=card, preset=yarns.model.preset, seed=yarns.variability.seed, scale="macro", test=piece.kind,
        direction=piece.direction, sets=settings,
    )  # fmt: skip


def width(run: Run) -> float:
    """Width [mm] of a strip of whole yarns: number times distance."""
    assert isinstance(run.rig, StripRig)
    return modelled_width(run, run.rig.direction)


def overhang(run: Run) -> float:
    """Overhang [mm] of a cantilever of this plan."""
    assert isinstance(run, CantileverRun)
    assert run.rig.overhang_mm is not None
    return run.rig.overhang_mm


def settings_for(texts: Sequence[str], piece: PlannedTest) -> list[Setting]:
    """Settings among ``texts`` that are for ``piece``."""
    kinds = {one.kind for one in (*PLANNED_TESTS, PlannedTest("biaxial"))}
    found = []
    for text in texts:
        kind, _, rest = text.partition(".")
        if kind == piece.kind:
            found.append(parse_set(rest))
        elif kind not in kinds:
            found.append(parse_set(text))
    return found


def command_setting(name: str, value: object) -> Setting:
    """Setting of the command itself."""
    return Setting(tuple(name.split(".")), value, "knittest homogenise")


#: largest strain of tensile paths over the strain at which straight yarns fail
STRAIN_MARGIN = 1.05
#: angle [deg] of the sheared cell: the last whole step of the law is beyond 40 deg; and the largest one, of a cell that
#: is relaxed at each row: loops lock later than inlays that cross, and soft shells are sheared further
ANGLE, RELAXED_ANGLE = 42.5, 60.0
#: strain [%] that counts as one of a direction without inlays in the angles of paths
KNIT_SCALE = 50.0
#: largest stretch and contraction [%] of paths along a direction that no inlay limits, and force per width [N/mm] at
#: which they end: loops have locked, and most of the force comes from stretched yarn
KNIT_STRAIN, KNIT_CONTRACTION, KNIT_FORCE = 80.0, 60.0, 1.0
#: the same strain and force of yarns with a soft shell
SOFT_STRAIN, SOFT_FORCE = 240.0, 0.4
#: way that yarns of a slack knit may slide, over their radius
KNIT_SLIP = 10.0
#: speed [m/s] of paths of both strains, their longest duration [ms], and highest speed
PATH_SPEED, PATH_TIME, HIGHEST_SPEED = 0.4, 20.0, 1.0


def cell_run(request: Request, piece: PlannedTest) -> Run:
    """Path of a cell in place of ``piece``; raises :class:`InputError` for invalid settings and other paths."""
    sets, fixed = settings_for(request.sets, piece), _path_settings(piece)
    for setting in sets:
        if (name := ".".join(map(str, setting.path))) in fixed:
            needed = f"{name} = {fixed[name]}"
            raise InputError(f"{setting.place}: {piece.name} of a cell needs {needed}: remove this setting")
    if piece.angle is not None:
        return _strained_cell_run(request, piece.angle, sets)
    settings = [command_setting(name, value) for name, value in fixed.items()]
    run = resolve_meso_run(request, "cell", None, [*settings, *sets])
    if run.variability.specimens > 1:
        raise InputError("variability.specimens: all yarns of a cell are equal: leave it at 1")
    usual = []  # tensile paths reach yarn failure, and the shear law ends beyond 40 deg
    if piece.kind == "tensile":
        usual = [command_setting("rig.max_strain", inlay_strain(run.fabric, str(piece.direction)))]
    elif piece.kind == "picture-frame":
        assert isinstance(run, CellRun)
        usual = [command_setting("rig.max_angle", RELAXED_ANGLE if run.is_relaxed else ANGLE)]
    return resolve_meso_run(request, "cell", None, [*settings, *usual, *sets])


def inlay_strain(fabric: Fabric, direction: str) -> float:
    """Strain [%] beyond that at which straight inlays of ``direction`` fail; without inlays about that of a knit."""
    most = fabric.straight_failure_strain(direction)
    return round(100.0 * STRAIN_MARGIN * most, 4) if np.isfinite(most) else KNIT_SCALE


def _strained_cell_run(request: Request, angle: float, sets: Sequence[Setting]) -> Run:
    """Path of a cell to strains of warp and weft at ``angle`` [deg] of their plane."""
    run = resolve_meso_run(request, "cell", None, [command_setting("rig.path", "biaxial"), *sets])
    if run.variability.specimens > 1:
        raise InputError("variability.specimens: all yarns of a cell are equal: leave it at 1")
    assert isinstance(run, CellRun)
    limited = any(setting.path == ("rig", "max_strain") for setting in sets)
    way = _path_end(run, angle, run.rig.max_strain if limited else np.inf)
    steps = [[0.0, 1.0, 0.0, 0.0, 1.0], [1.0, 1.0 + 0.01 * way[1], 0.0, 0.0, 1.0 + 0.01 * way[0]]]
    speed = max(PATH_SPEED, round(float(np.abs(way).max()) / PATH_TIME, 3))
    knit = any(not run.fabric.inlays_along(direction) for direction in DIRECTIONS)
    settings = [
        command_setting("rig.path", "steps"),
        command_setting("rig.steps", [tuple(float(round(v, 9)) for v in row) for row in steps]),
        command_setting("rig.at_fracture", "ends"),
    ]
    if not run.fabric.has_soft_yarns:
        settings.append(command_setting("solver.speed", min(speed, HIGHEST_SPEED) if knit else speed))
    if knit:  # most paths end early, by their force
        settings += [
            command_setting("rig.max_force", SOFT_FORCE if run.fabric.has_soft_yarns else KNIT_FORCE),
            command_setting("rig.max_slip", KNIT_SLIP),
        ]
    others = [setting for setting in sets if setting.path != ("rig", "max_strain")]
    return resolve_meso_run(request, "cell", None, [*settings, *others])


def _path_end(run: CellRun, angle: float, most: float) -> Array:
    """Strains [%] of warp and weft at the end of a path: the first one that is at its limit, ``most`` for both, at
    ``angle`` [deg] of their plane, each over the largest strain of its direction.
    """
    inlay = np.array([inlay_strain(run.fabric, d) for d in DIRECTIONS])
    way = np.array([np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))]) * np.minimum(inlay, most)
    knit = np.array([not run.fabric.inlays_along(d) for d in DIRECTIONS])
    stretched = SOFT_STRAIN if run.fabric.has_soft_yarns else KNIT_STRAIN
    limit = np.where(knit, np.where(way > 0.0, stretched, KNIT_CONTRACTION), inlay)
    return np.asarray(way * np.min(np.minimum(limit, most) / np.maximum(np.abs(way), 1e-9)))


def strains_at_end(run: Run) -> tuple[float, float]:
    """Strains [-] of warp and weft at the end of a path of :func:`cell_run`."""
    assert isinstance(run, CellRun)
    _, weft, _, _, warp = run.rig.steps[-1]
    return warp - 1.0, weft - 1.0


def _rounded_down(angle: float) -> float:
    """Largest tenth of a degree up to ``angle`` [deg]: the angle in the file of the law is rounded too."""
    return floor(10.0 * angle) / 10.0


def cell_macro_run(
    piece: PlannedTest, yarns: Run, card: Path, last_angle: float, stiffness: dict[Direction, float],
    reached: float = 1.0,
) -> Run:  # fmt: skip
    """Macro run of ``piece`` of usual size; ``last_angle`` [deg] ends frames, ``stiffness`` [N mm] sets overhangs, and
    the share of the path that the cell has ``reached`` ends biaxial tests.
    """
    if piece.kind == "picture-frame":
        return resolve_macro_run(piece, yarns, card, [command_setting("rig.max_angle", _rounded_down(last_angle))])
    if piece.angle is not None:
        direction: Direction = "warp" if piece.angle <= 45.0 else "weft"
        other = 1 if direction == "warp" else 0
        ends = np.array(strains_at_end(yarns))
        most = REPEATED_SHARE * reached * float(ends[1 - other])
        square = [
            command_setting("rig.ratio", max(float(round(ends[other] / ends[1 - other], 6)), 0.0)),
            command_setting("rig.max_strain", float(f"{100.0 * most:.6g}")),
        ]
        return resolve_macro_run(replace(piece, direction=direction), yarns, card, square)
    whole = command_setting("rig.width", width(resolve_macro_run(piece, yarns, card, [])))
    run = resolve_macro_run(piece, yarns, card, [whole])
    if not isinstance(run, CantileverRun) or piece.direction is None:
        return run
    overhang = round(overhang_for_chord(stiffness[piece.direction], run), 1)
    length = max(run.rig.length, round(LENGTH_FACTOR * overhang, 1))
    more = [
        whole,
        command_setting("rig.mode", "angle"),
        command_setting("rig.overhang", overhang),
        command_setting("rig.length", length),
    ]
    return resolve_macro_run(piece, yarns, card, more)


def _path_settings(piece: PlannedTest) -> dict[str, object]:
    if piece.angle is not None:
        return {"rig.path": "steps", "rig.steps": "those of the plan", "rig.at_fracture": "ends"}
    if piece.kind == "tensile":
        return {"rig.path": piece.direction, "rig.at_fracture": "ends"}
    if piece.kind == "cantilever":
        return {"rig.path": "bending", "rig.bent_yarns": piece.direction}
    return {"rig.path": "shear"}
