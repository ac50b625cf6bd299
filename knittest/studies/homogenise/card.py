"""The material card: what tests of yarns say of tension, shear and bending, and the fabric file that holds it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

import numpy as np

from knittest.base.atomic import write_atomic
from knittest.config.dumping import dump_mapping
from knittest.config.fabric import Direction
from knittest.config.run import Run
from knittest.config.shear import ELASTIC
from knittest.experiment.curves import FORCE_PER_WIDTH
from knittest.export.own_data import OWN, kept_beside
from knittest.laboratory.cell.config import CellRun
from knittest.laboratory.tensile.config import TensileRun
from knittest.materials.trellis import ANGLE
from knittest.studies.homogenise import measures
from knittest.studies.homogenise.curves import Array
from knittest.studies.homogenise.measures import Tested
from knittest.studies.homogenise.plan import PIECES, Piece, width

FABRIC = "fabric.yaml"
#: characters of a fabric's name, and what is added to it
LONGEST_NAME, SUFFIX = 40, "-homogenised"
DIRECTIONS: tuple[Direction, ...] = get_args(Direction)


@dataclass(frozen=True)
class Card:
    """Numbers of the shells: tension curves, strain [%] and force per width [N/mm], by direction; shear law, angle
    [deg] and conjugate force [N/mm]; bending stiffness [N mm] by direction. ``tests`` are those it was made of.
    """

    tension: dict[Direction, tuple[Array, Array]]
    shear: tuple[Array, Array]
    bending: dict[Direction, float]
    tests: dict[Piece, Tested]


def card_of(tests: dict[Piece, Tested]) -> Card:
    """The card that the finished ``tests`` lead to; raises :class:`NumericalError` for a curve of too few points."""
    tension: dict[Direction, tuple[Array, Array]] = {}
    bending: dict[Direction, float] = {}
    shear: tuple[Array, Array] = (np.zeros(1), np.zeros(1))
    for piece, test in tests.items():
        if piece.kind == "picture-frame":
            shear = measures.shear_law(test)
        elif piece.direction and piece.kind == "tensile":
            tension[piece.direction] = measures.tension(test)
        elif piece.direction:
            bending[piece.direction] = measures.bending_stiffness(test)
    return Card(tension, shear, bending, tests)


def write_card(card: Card, folder: Path, command: str) -> Path:
    """Write the fabric file and its curves to ``folder``; returns its path. Raises :class:`ResourceError`."""
    data = folder / OWN
    data.mkdir(exist_ok=True)
    run = next(iter(card.tests.values())).run
    kind = f"# kind: simulated\n# fabric: {_name(run)}\n"
    for direction, (strain, force) in card.tension.items():
        head = kind + _tension_head(card, direction, strain, force)
        write_atomic(data / f"tension-{direction}.csv", head + _rows(strain, force))
    head = f"{kind}# source: {_story(card, 'picture-frame')}\n{ANGLE},shear_force_n_per_mm\n"
    write_atomic(data / "shear.csv", head + _rows(*card.shear))
    said = f"# Fabric {run.fabric.name} with a material card of the shells from tests of its yarns, by\n#   {command}\n"
    write_atomic(folder / FABRIC, said + dump_mapping(_fabric(card, run, folder), ("fabric",)))
    return folder / FABRIC


def card_numbers(card: Card) -> dict[str, float]:
    """The single numbers of the card by their field, and the ends of its curves."""
    found: dict[str, float] = {}
    for direction in DIRECTIONS:
        strain, force = card.tension[direction]
        found[f"fracture_strain.{direction} [%]"] = float(strain[-1])
        found[f"tension.{direction}, peak [N/mm]"] = float(force[-1])
        found[f"bending_stiffness.{direction} [N mm]"] = card.bending[direction]
    found["shear, last angle [deg]"] = float(card.shear[0][-1])
    found["shear, last force [N/mm]"] = float(card.shear[1][-1])
    return found


def _name(run: Run) -> str:
    return run.fabric.name[: LONGEST_NAME - len(SUFFIX)] + SUFFIX


def _fabric(card: Card, run: Run, folder: Path) -> dict[str, Any]:
    """Fields of the fabric of ``run`` with the card as its macro material."""
    data: dict[str, Any] = run.fabric.model_dump(mode="json", exclude_none=True)
    data["name"] = _name(run)
    data["title"] = f"{run.fabric.title}; shells homogenised from yarns".removeprefix("; ")
    macro = data["macro"]
    friction = ELASTIC if run.fabric.macro.shear is None else run.fabric.macro.shear.friction_share
    macro["tension"] = {d: f"{OWN}/tension-{d}.csv" for d in DIRECTIONS}
    macro["fracture_strain"] = {
        d: _derived(float(card.tension[d][0][-1]), _story(card, "tensile", d)) for d in DIRECTIONS
    }
    macro["bending_stiffness"] = {d: _derived(card.bending[d], _story(card, "cantilever", d)) for d in DIRECTIONS}
    macro["shear"] = {
        "kind": "table", "curve": f"{OWN}/shear.csv", "source": "derived", "ref": _story(card, "picture-frame"),
        "friction_share": friction.model_dump(mode="json", exclude_none=True),
    }  # fmt: skip
    if data.get("experiment"):
        data["experiment"] = kept_beside(data["experiment"], folder, "experiment")
    return data


def _tension_head(card: Card, direction: Direction, strain: Array, force: Array) -> str:
    """Source and conditions of a tension curve, its end, and the names of its columns."""
    run = card.tests[Piece("tensile", direction)].run
    lines = [f"source: {_story(card, 'tensile', direction)}", "test: tensile", f"direction: {direction}"]
    if isinstance(run, TensileRun):
        lines += [f"strip_width_mm: {width(run):.6g}", f"gauge_length_mm: {run.rig.gauge_length:g}"]
    lines += [f"fracture_strain_pct: {strain[-1]:.6g}", f"peak_force_n_per_mm: {force[-1]:.6g}"]
    return "".join(f"# {line}\n" for line in lines) + f"strain_pct,{FORCE_PER_WIDTH}\n"


def _derived(value: float, ref: str) -> dict[str, Any]:
    return {"value": float(f"{value:.6g}"), "source": "derived", "ref": ref}


def _story(card: Card, kind: str, direction: Direction | None = None) -> str:
    """Sentence on the run that a number comes from."""
    piece = next(p for p in PIECES if (p.kind, p.direction) == (kind, direction))
    test = card.tests[piece]
    run = test.run
    of = f"{piece.name} of yarns"
    if isinstance(run, CellRun):
        alike = ", yarns all alike: none is weaker" if kind == "tensile" else ""
        of = f"path {run.rig.path} of a cell without an edge{alike}"
    return (
        f"homogenised from run trials/{test.key}: {of}, {run.fabric.name}, {run.parameters}, preset "
        f"{run.model.preset}, seed {run.variability.seed}"
    )


def _rows(x: Array, y: Array) -> str:
    return "".join(f"{a:.6g},{b:.6g}\n" for a, b in zip(x, y, strict=True))
