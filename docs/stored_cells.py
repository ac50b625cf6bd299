"""Relaxed cells that pages quote, in docs/cells.json: thickness, mass and crimp of both variants, and their inputs."""

import json
import math
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from knittest.config.fabric import Fabric
from knittest.config.loading import resolve
from knittest.export.identity import git_commit
from knittest.export.summary import timestamp
from knittest.fabric.cell import Cell, CellSpec
from knittest.laboratory.numerical_error import mesh_factor

FILE = Path(__file__).parent / "cells.json"
#: nodes of the yarns of the cell that shows the error, over those of the cell itself: as with --verify
FINER = 1.5


@dataclass(frozen=True)
class StoredCell:
    """Thickness [mm], area mass [g/m2] by lengths of yarns, as ``knittest check`` counts it, and crimps [-] of the cell
    with ``spec`` (mm, N mm2); ``error`` is the numerical one of both, from the cell with finer yarns.
    """

    thickness_mm: float
    area_mass_g_m2: float
    crimp: dict[str, float]
    spec: dict[str, Any]
    commit: str | None
    date: str
    error: dict[str, float]

    def stale(self, variant: str) -> list[str]:
        """Inputs that the cell of ``variant`` is given now and was not then."""
        is_now = _spec(fabric_of(variant))
        return [
            f"{name} was {self.spec.get(name)}, is {value}"
            for name, value in is_now.items()
            if self.spec.get(name) != value
        ]


@cache
def fabric_of(variant: str) -> Fabric:
    """A shipped variant, calibrated."""
    return resolve(variant=variant, test="tensile", scale="meso").fabric


def relaxed(variant: str) -> StoredCell:
    """Relax the cell of ``variant``, or take it from the cache."""
    from knittest.fabric.relaxation import relax_cell, relaxed_cell

    fabric = fabric_of(variant)
    cell = relaxed_cell(fabric, lambda: None)
    found, fine = _numbers(fabric, cell), _numbers(fabric, relax_cell(cell.spec, FINER))
    error = {name: mesh_factor(FINER, finer=True) * abs(fine[name] - value) for name, value in found.items()}
    crimp = {system: cell.crimp(system) for system in ("warp", "weft")}
    return StoredCell(**found, crimp=crimp, spec=_spec(fabric), commit=git_commit(), date=timestamp(), error=error)


def _numbers(fabric: Fabric, cell: Cell) -> dict[str, float]:
    """Thickness [mm] and area mass [g/m2] of ``cell``."""
    from knittest.runs.preflight.yarn_counterparts import cell_mass

    mass = 1e6 * cell_mass(fabric, cell) / math.prod(cell.spec.size)
    return {"thickness_mm": cell.thickness, "area_mass_g_m2": mass}


def load() -> dict[str, StoredCell]:
    """Stored cells by variant."""
    return {name: StoredCell(**cell) for name, cell in json.loads(FILE.read_text(encoding="utf-8")).items()}


def save(cells: dict[str, StoredCell]) -> None:
    """Write all ``cells``."""
    FILE.write_text(json.dumps({name: asdict(cell) for name, cell in cells.items()}, indent=1) + "\n", encoding="utf-8")


def _spec(fabric: Fabric) -> dict[str, Any]:
    """Inputs of the cell, as the file holds them."""
    found: dict[str, Any] = json.loads(json.dumps(asdict(CellSpec.of(fabric))))
    return found
