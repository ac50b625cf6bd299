"""Files of compaction tests as ``knittest data`` takes them: thickness between two plates over their pressure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import PLATE_AREA, PLATE_DIAMETER
from knittest.experiment.lab_recording import Origin, Recording, make_reader
from knittest.experiment.lab_results import Curves, Results
from knittest.experiment.lab_shear import digests, first_loading, refuse_outliers
from knittest.experiment.lab_tests import LabTest
from knittest.experiment.statistics import Array, Corridor
from knittest.laboratory.compaction.van_wyk import PRESSURES, thickness_at

NAME = "compaction"
#: thickness of textiles [mm], and pressure [kPa] that a test must reach at least and can at most
THICKNESSES, REACHED = (0.05, 50.0), (1.0, 1e5)
PLACES = 100


@dataclass(frozen=True)
class PressedPiece(Origin):
    """Pressure [kPa], rising, and thickness [mm] of one piece on its first loading, (n,) each."""

    pressure: Array
    thickness: Array

    def at(self, pressure: Array) -> Array:
        """Thickness [mm] at each ``pressure`` [kPa], evaluated as of a run."""
        return np.array([thickness_at(self.thickness, self.pressure, float(p)) for p in pressure])


def _read_piece(r: Recording) -> PressedPiece:
    """Read a pressure, or convert a force to one by the plate."""
    origin = r.read()
    pressure, thickness = r.values.get("pressure"), r.values["thickness"]
    if pressure is None:
        area = r.find(PLATE_AREA) or 0.25 * np.pi * r.require(PLATE_DIAMETER)[0] ** 2
        pressure = 1e3 * r.values["force"] / area
    pressure = pressure if pressure.max() >= -pressure.min() else -pressure
    rows, _ = first_loading(pressure)
    thickness, pressure = thickness[rows], pressure[rows]
    count, (low, high), (thin, thick) = np.count_nonzero(pressure > 0.0), REACHED, THICKNESSES
    if count < 3 or not low <= pressure[-1] <= high:
        raise InputError(
            f"{r.place}: {count} rows up to {pressure[-1]:.4g} kPa; expected 3 or more, up to {low:g} to {high:g} "
            "kPa: check the unit of the pressure"
        )
    if not thin <= thickness.min() <= thickness.max() <= thick:
        raise InputError(
            f"{r.place}: thickness {thickness.min():.4g} to {thickness.max():.4g} mm; expected {thin:g} to {thick:g} "
            "mm: check the unit of the thickness"
        )
    if thickness[-1] >= thickness[0]:
        raise InputError(
            f"{r.place}: {thickness[0]:.4g} mm at the start and {thickness[-1]:.4g} mm at {pressure[-1]:.4g} kPa; "
            "expected the distance of the plates, which falls, not their travel"
        )
    return PressedPiece(**origin, pressure=pressure, thickness=thickness)


def _results(pieces: Sequence[PressedPiece]) -> Results:
    low = max(float(s.pressure[s.pressure > 0.0][0]) for s in pieces)
    high = min(float(s.pressure[-1]) for s in pieces)
    at = np.array([p for p in PRESSURES if low <= p <= high])
    if not len(at):
        raise InputError(
            f"{pieces[0].path}: the pieces have only {low:.3g} to {high:.3g} kPa in common; expected one of "
            f"{', '.join(f'{p:g}' for p in PRESSURES)} kPa in this range"
        )
    values = np.array([s.at(at) for s in pieces]).T
    refuse_outliers(pieces, values[0], "thickness", "mm")
    pressure = np.geomspace(low, high, PLACES)
    curves = np.array([s.at(pressure) for s in pieces])
    sd = curves.std(axis=0, ddof=1) if len(pieces) > 1 else np.full(PLACES, np.nan)
    found = {f"thickness_mm_at_kpa.{p:g}": row for p, row in zip(at, values, strict=True)}
    return Results(
        found, dict.fromkeys(found, "mm"), [], ("piece", f"up to {high:.4g} kPa"),
        digests(pieces, [(s.thickness, s.pressure) for s in pieces]),
        [(f"{p:g} kPa [mm]", ".4g", row) for p, row in zip(at, values, strict=True)],
        ["first loading only; the travel of the empty plates must have been subtracted"],
        Curves(
            [(s.pressure, s.thickness) for s in pieces], Corridor(pressure, curves.mean(axis=0), sd, len(pieces)),
            ("pressure_kpa", "thickness_mm", "thickness_sd_mm"),
            ("pressure [kPa]", "thickness between the plates [mm]"),
        ),
    )  # fmt: skip


def _rig(test: dict[str, Any]) -> dict[str, float]:
    pressures = [float(name.rpartition(".")[2]) for name in test if name.startswith("thickness_mm_at")]
    return {"max_pressure": max(*pressures, 10.0)}


LAB = LabTest(
    NAME,
    make_reader(
        [("pressure", "force"), ("thickness",)], "a thickness and a pressure, or a force on a plate of known diameter",
        _read_piece, own=("compression", "cyclic"),
    ),
    _results, (PLATE_DIAMETER,), rig=_rig,
)  # fmt: skip
