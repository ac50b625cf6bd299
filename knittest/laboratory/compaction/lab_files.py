"""Files of compaction tests as ``knittest data`` takes them: thickness between two plates over their pressure."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.atomic import write_atomic
from knittest.base.errors import InputError
from knittest.base.units import ratios
from knittest.experiment import lab_units
from knittest.experiment.lab_checks import digest, refuse_apart, refuse_copies
from knittest.experiment.lab_fabric import finish
from knittest.experiment.lab_folder import curve_text
from knittest.experiment.lab_given import Given, first_loading
from knittest.experiment.lab_kind import LabTest, Rigs
from knittest.experiment.lab_lines import table_lines
from knittest.experiment.lab_numbers import NUMBER, plain
from knittest.experiment.lab_picture import plot
from knittest.experiment.lab_series import Results, write_results
from knittest.experiment.lab_table import LabTable, columns, read_table
from knittest.experiment.statistics import Corridor
from knittest.laboratory.compaction.van_wyk import PRESSURES, thickness_at

Array = NDArray[np.float64]

NAME = "compaction"
THICKNESS = re.compile(r"thickness|dicke|\bgap\b|spalt", re.I)
PRESSURE = re.compile(r"pressure|druck(?!kraft|platte)|\bstress\b|spannung", re.I)
#: factors to kPa
PRESSURE_UNITS = ratios("kPa", "MPa", "Pa")
#: thickness of textiles [mm], and pressure [kPa] that a test must reach at least and can at most
THICKNESSES, REACHED = (0.05, 50.0), (1.0, 1e5)
PLACES = 100
_NAMED = re.compile(r"compaction|kompaktier|kompression|thickness|dicke", re.I)


@dataclass(frozen=True)
class Pressed:
    """Pressure [kPa], rising, and thickness [mm] of one piece on its first loading, (n,) each."""

    name: str
    pressure: Array
    thickness: Array
    path: Path

    def at(self, pressure: Array) -> Array:
        """Thickness [mm] at each ``pressure`` [kPa], as of a run."""
        return np.array([thickness_at(self.thickness, self.pressure, float(p)) for p in pressure])


def read_compaction(path: Path, given: Given) -> list[Pressed]:
    """Pieces in one export, told apart by repeated pairs of columns of thickness and pressure.

    Raises :class:`InputError` for a pressure without a unit, as :func:`knittest.experiment.lab_csv.read_lab` for units,
    text and gaps, and for a thickness that no textile has or that grows under pressure.
    """
    wanted = "a thickness and a pressure (of a force: divide it by the area of the plates)"
    table = read_table(path, lambda cells: bool(_pairs(cells)), wanted, given.decimal, given.delimiter)
    pairs = _pairs(table.names)
    names = [path.stem if len(pairs) == 1 else f"{path.stem}-{k + 1}" for k in range(len(pairs))]
    return [_pressed(table, name, pair) for name, pair in zip(names, pairs, strict=True)]


def _pairs(cells: list[str]) -> list[tuple[int, int]]:
    """Columns of (thickness, pressure), in their order."""
    words = [(k, cell) for k, cell in enumerate(cells) if not NUMBER.match(cell)]
    thick = [k for k, cell in words if THICKNESS.search(cell)]
    pressed = [k for k, cell in words if PRESSURE.search(cell) and k not in thick]
    return list(zip(thick, pressed, strict=True)) if len(thick) == len(pressed) else []


def _pressed(table: LabTable, name: str, pair: tuple[int, int]) -> Pressed:
    where = f"{table.path}: specimen {name}"
    _, values = columns(table, pair, name)
    lengths = lab_units.stated(table.names[pair[0]], table.units[pair[0]], lab_units.LENGTH, table.where)
    unit = lab_units.stated(table.names[pair[1]], table.units[pair[1]], PRESSURE_UNITS, table.where)
    if not unit:
        raise InputError(
            f"{table.where}: column {table.names[pair[1]]!r}: a pressure without a unit: write "
            f"'{table.names[pair[1]]} [kPa]', or one of {', '.join(PRESSURE_UNITS)}"
        )
    thickness, pressure = values[:, 0] * lab_units.LENGTH[lengths or "mm"], values[:, 1] * PRESSURE_UNITS[unit]
    rows, _ = first_loading(pressure)
    thickness, pressure = thickness[rows], pressure[rows]
    count = np.count_nonzero(pressure > 0.0)
    if count < 3 or not REACHED[0] <= pressure[-1] <= REACHED[1]:
        raise InputError(
            f"{where}: {count} rows up to {pressure[-1]:.4g} kPa: expected at least 3, up to {REACHED[0]:g} to "
            f"{REACHED[1]:g} kPa: check the unit of the pressure"
        )
    if not THICKNESSES[0] <= thickness.min() <= thickness.max() <= THICKNESSES[1]:
        raise InputError(
            f"{where}: thickness from {thickness.min():.4g} to {thickness.max():.4g} mm: expected "
            f"{THICKNESSES[0]:g} to {THICKNESSES[1]:g} mm: check the unit of the thickness"
        )
    if thickness[-1] >= thickness[0]:
        raise InputError(
            f"{where}: {thickness[0]:.4g} mm at the start and {thickness[-1]:.4g} mm at {pressure[-1]:.4g} kPa: "
            "expected the distance of the plates, which falls, and not their way"
        )
    return Pressed(name, pressure, thickness, table.path)


def compaction_results(pieces: Sequence[Pressed], files: Sequence[str]) -> Results:
    """Thickness at the pressures of a run that all ``pieces`` were measured at; raises :class:`InputError` for none of
    them, for copies and for pieces that are not of one series.
    """
    low, high = _common(pieces)
    at = np.array([p for p in PRESSURES if low <= p <= high])
    if not len(at):
        raise InputError(
            f"{pieces[0].path}: all pieces together were measured from {low:.3g} to {high:.3g} kPa: expected one of "
            f"{', '.join(f'{p:g}' for p in PRESSURES)} kPa in it"
        )
    refuse_apart([(s.name, s.path) for s in pieces], np.array([float(s.at(at)[0]) for s in pieces]), "thickness", "mm")
    digests = [digest(s.thickness, s.pressure) for s in pieces]
    refuse_copies([(s.name, d) for s, d in zip(pieces, digests, strict=True)])
    values = np.array([s.at(at) for s in pieces]).T
    found = {f"thickness_mm_at_kpa.{p:g}": row for p, row in zip(at, values, strict=True)}
    most = f"up to {high:.4g} kPa"
    return Results(NAME, "", found, dict.fromkeys(found, "mm"), [], ("piece", most), files, digests)


def _common(pieces: Sequence[Pressed]) -> tuple[float, float]:
    """Pressures [kPa] between which all ``pieces`` were measured."""
    return max(float(s.pressure[s.pressure > 0.0][0]) for s in pieces), min(float(s.pressure[-1]) for s in pieces)


def _lines(pieces: Sequence[Pressed]) -> list[str]:
    """Table of the thickness at each pressure, with mean and sd."""
    found = compaction_results(pieces, []).found
    heads = [(f"{name.rpartition('.')[2]} kPa [mm]", ".4g") for name in found]
    rows = np.array(list(found.values())).T
    return [
        *table_lines(heads, [(s.name, values) for s, values in zip(pieces, rows, strict=True)]),
        "first loading alone; the way of the empty plates must have been subtracted",
    ]


def _write(pieces: Sequence[Pressed], out: Path, direction: str, files: Sequence[str], trusted: bool = False) -> str:
    """Write ``compaction.csv`` and ``compaction/`` into the experiment ``out``; returns its variant."""
    results = compaction_results(pieces, files)
    inner, notes = write_results(out, results), results.notes(out)
    for number, s in enumerate(pieces, 1):
        text = curve_text(
            [f"# specimen: {s.name}", *notes[1:]], {"pressure_kpa": s.pressure, "thickness_mm": s.thickness}
        )
        write_atomic(inner / f"specimen-{number:02d}.csv", text)
    pressure = np.geomspace(*_common(pieces), PLACES)
    values = np.array([s.at(pressure) for s in pieces])
    sd = values.std(axis=0, ddof=1) if len(pieces) > 1 else np.full(PLACES, np.nan)
    band = Corridor(pressure, values.mean(axis=0), sd, len(pieces))
    mean = {"pressure_kpa": pressure, "thickness_mm": band.mean, "thickness_sd_mm": band.sd}
    write_atomic(inner / "corridor.csv", curve_text(notes, mean))
    curves = [(s.pressure, s.thickness) for s in pieces]
    plot(curves, band, ("pressure [kPa]", "thickness between the plates [mm]"), inner / "curves.png")
    finish(out)
    return out.resolve().name


def _looks(cells: Sequence[str]) -> bool:
    return any(PRESSURE.search(cell) for cell in cells) and any(THICKNESS.search(cell) for cell in cells)


def _rigs(tests: Mapping[str, dict[str, Any]]) -> Rigs:
    """The largest pressure at which there is a thickness."""
    pressures = [float(name.rpartition(".")[2]) for name in tests.get(NAME, {}) if name.startswith("thickness_mm_at")]
    return {NAME: {"max_pressure": plain(max(max(pressures), 10.0))}} if pressures else {}


LAB = LabTest(read_compaction, _lines, _write, (), (), _looks, _NAMED, _rigs)
