"""Rows of docs/validation.md that need no run: mass and thickness of the yarns' model, the variants in shear."""

from collections.abc import Mapping, Sequence

import numpy as np

from docs.stored_cells import StoredCell, fabric_of
from docs.validation_rows import LIMIT_SD, density, measured
from knittest.base.files import data_dir
from knittest.config.loading import resolve
from knittest.experiment.curves import load_curve
from knittest.experiment.origin import cell_row_kind
from knittest.experiment.tables import PublishedValue

CELL_HEAD = (
    "variant",
    "quantity",
    "measured",
    "simulated",
    "baseline",
    "deviation",
    "that of the baseline",
    "in sd",
    "kind",
    "verdict",
)
SHEAR_HEAD = ("angle [deg]", "V1 [N/mm]", "V2 [N/mm]", "V2 over V1", "published", "verdict")
ANGLES = (10.0, 20.0, 30.0, 40.0)


def cell_rows(cells: Mapping[str, StoredCell]) -> tuple[Sequence[str], list[list[str]]]:
    """Header and lines of mass and thickness; the copy is the other variant's row, a mass in proportion to the length
    of inlays in an area.
    """
    lines = []
    for variant, cell in sorted(cells.items()):
        for quantity, name in (("area_mass", "area_mass_g_m2"), ("thickness", "thickness_mm")):
            lines.append(_cell_line(variant, quantity, name, (getattr(cell, name), cell.error[name])))
    return CELL_HEAD, lines


def _cell_line(variant: str, quantity: str, name: str, found: tuple[float, float]) -> list[str]:
    """Line of ``quantity``, which the model calls ``name``: its value and error ``found``."""
    value, error = found
    (row,), (other,) = (measured(v, "", [quantity]) for v in (variant, "2" if variant == "1" else "1"))
    copy = other.mean * (_inlays(variant) / _inlays("2" if variant == "1" else "1") if quantity == "area_mass" else 1.0)
    deviation = (value - row.mean) / row.sd
    return [
        variant, f"{quantity.replace('_', ' ')} [{row.unit}]", f"{row.mean:g} ± {row.sd:g}",
        f"{value:.4g} ± {error:.2g}",
        f"{copy:.4g}", _off(value, row), _off(copy, row), f"{deviation:+.2f}",
        cell_row_kind(fabric_of(variant), name), verdict(deviation, error / row.sd),
    ]  # fmt: skip


def verdict(deviation: float, error: float = 0.0) -> str:
    """Verdict on a deviation with its numerical error, both in standard deviations."""
    passed = "passed" if abs(deviation) <= LIMIT_SD else "**FAILED**"
    return f"{passed}, within ± open" if abs(abs(deviation) - LIMIT_SD) < error else passed


def _inlays(variant: str) -> float:
    return density(variant, "warp") + density(variant, "weft")


def _off(value: float, row: PublishedValue) -> str:
    return f"{100.0 * (value / row.mean - 1.0):+.1f} %"


def shear_rows() -> tuple[Sequence[str], list[list[str]]]:
    """Header and lines of the order of both variants in shear."""
    v1, v2 = ([law(variant, angle) for angle in ANGLES] for variant in ("1", "2"))
    return SHEAR_HEAD, [shear_line(*row) for row in zip(ANGLES, v1, v2, strict=True)]


def shear_line(angle: float, first: float, second: float) -> list[str]:
    """Line of one angle; the rule is that variant 2 lies below variant 1."""
    ratio = second / first
    verdict = "passed" if ratio < 1.0 else "**FAILED**"
    return [
        f"{angle:g}",
        f"{first:.4f}",
        f"{second:.4f}",
        f"{ratio:.2f} ({100.0 * (ratio - 1.0):+.0f} %), ± not estimated",
        "below 1",
        verdict,
    ]


def law(variant: str, angle: float, parameters: str = "calibrated") -> float:
    """Force [N/mm] at ``angle`` [deg] of the shear law that shells of ``variant`` have in the set ``parameters``."""
    shear = resolve(variant=variant, scale="macro", parameters=parameters).fabric.macro.shear
    curve = load_curve(data_dir() / str(shear.curve))
    return float(np.interp(angle, curve.x, curve.mean))
