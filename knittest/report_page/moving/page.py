"""Writes ``view.html``: an interactive view of a run in one small file."""

import base64
import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest import __version__
from knittest.base.errors import InputError
from knittest.base.files import write_atomic
from knittest.base.history import Body
from knittest.report_page.loaded_run import LoadedRun, load_run
from knittest.report_page.moving.recording import (
    Array,
    Recording,
    Scale,
    diverging_colours,
    read_recording,
    scales_of,
    sequential_colours,
)
from knittest.report_page.page import VIEW, refresh_report
from knittest.report_page.pictures import data_uri

# Recordings are compressed as deflated differences of whole numbers, in time and along the nodes: neighbouring nodes
# move alike, so that most second differences fit a byte.

#: whole numbers of a position: 16 bits
STEPS = 65535


@dataclass
class Packer:
    """Arrays one after the other in ``data``."""

    data: bytearray = field(default_factory=bytearray)

    def add(self, values: NDArray[np.integer], width: int) -> dict[str, Any]:
        """Add whole ``values`` (k, n, d) of ``width`` bytes (1, 2 or 4); returns their entry: place, width, shape."""
        entry = {"at": len(self.data), "width": width, "shape": list(values.shape)}
        self.data += pack_values(values, width)
        return entry

    def deflate(self) -> bytes:
        """All arrays in zlib's format."""
        return zlib.compress(bytes(self.data), 9)


def pack_values(values: NDArray[np.integer], width: int) -> bytes:
    """Bytes of whole ``values`` (k, n, d): differences along two axes, folded to positive numbers, low bytes first."""
    bits = 8 * width
    rest: Any = np.diff(np.diff(values.astype(np.int64), axis=0, prepend=0), axis=1, prepend=0)
    rest = ((rest + (1 << (bits - 1))) & ((1 << bits) - 1)) - (1 << (bits - 1))
    folded = np.moveaxis((rest << 1) ^ (rest >> (bits - 1)), 2, 0).ravel() & ((1 << bits) - 1)
    return b"".join(((folded >> (8 * k)) & 255).astype(np.uint8).tobytes() for k in range(width))


def quantise_positions(position: Array) -> tuple[NDArray[np.int64], Array, float]:
    """Positions (..., 3) [mm] in whole steps from their lower corner (3,), and the step [mm]."""
    low = position.reshape(-1, 3).min(axis=0)
    step = float(np.ptp(position.reshape(-1, 3), axis=0).max()) / STEPS or 1.0
    return np.round((position - low) / step).astype(np.int64), low, step


def pack_recording(recording: Recording, scales: dict[str, Scale]) -> tuple[dict[str, Any], bytes]:
    """Header for JSON and deflated numbers, for the script of the page."""
    packer = Packer()
    values, low, step = quantise_positions(recording.position)
    alive = recording.fields.get("alive", np.ones((len(recording.time), len(recording.cells)))) > 0.5
    cells = np.column_stack([recording.cells, recording.part])
    micrometres = np.round(1e3 * recording.radius).astype(np.int64)
    header = {
        "kind": recording.kind,
        "parts": recording.part_names,
        "time": [round(float(t), 6) for t in recording.time],
        "low": low.tolist(),
        "step": step,
        "position": packer.add(values, 2),
        "cells": packer.add(cells[None], 4),
        "radius": packer.add(micrometres[None, :, None], 4),
        "alive": packer.add(alive[:, :, None].astype(np.int64), 1),
        "fields": [
            {**vars(scale), "codes": packer.add(scale.codes(recording.fields[name])[:, :, None], 1)}
            for name, scale in scales.items()
        ],
        "bodies": [_pack_body(body, packer) for body in recording.bodies],
    }
    return header, packer.deflate()


def _pack_body(body: Body, packer: Packer) -> dict[str, Any]:
    values, low, step = quantise_positions(body.points)
    return {
        "name": body.name,
        "low": low.tolist(),
        "step": step,
        "points": packer.add(values[None], 2),
        "triangles": packer.add(body.triangles[None], 4),
        "offset": np.round(body.offset, 5).tolist(),
        "turn": None if body.turn is None else np.round(body.turn.reshape(-1, 9), 7).tolist(),
    }


GENERATOR = "knittest view"
FOLDER = Path(__file__).parent
THREE, VERSION = FOLDER / "vendor" / "three", "0.170.0"
#: modules of the page by their import name
MODULES = {
    "three": THREE / "three.module.min.js",
    "orbit": THREE / "OrbitControls.js",
    **{name: FOLDER / "page_files" / f"{name}.js" for name in ("decode", "shaders", "scene")},
}
#: points, width and height of the small curve
CURVE_POINTS, WIDE, HIGH = 400, 200.0, 84.0


def write_view(folder: Path, frames: int | None = None) -> Path:
    """Write the interactive view of a run folder, of ``frames`` frames at most, and link it in the report.

    Returns its path. Raises :class:`InputError` for a folder without a run or frames, :class:`ResourceError` when the
    page cannot be written.
    """
    if frames is not None and frames < 2:
        raise InputError(f"--frames {frames}: expected at least 2")
    run = load_run(folder)
    recording = read_recording(folder)
    if frames is not None:
        recording = recording.with_fewer_frames(frames)
    header, data = pack_recording(recording, scales_of(recording))
    header |= {
        "maps": {"sequential": sequential_colours(), "diverging": diverging_colours()},
        **_curve(run, recording.time),
    }
    page = folder / VIEW
    write_atomic(page, _html(run, header, data))
    refresh_report(folder)
    return page


def _html(run: LoadedRun, header: Mapping[str, Any], data: bytes) -> str:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    loader = FileSystemLoader(FOLDER / "page_files")
    environment = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    curve = header["curve"]
    return environment.get_template("view.html").render(
        title=run.title,
        subtitle=str(run.setting("fabric", "title") or ""),
        notices=notices(run),
        path="M" + "L".join(f"{x},{y}" for x, y in curve["place"]) if curve else "",
        header=json.dumps(header, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c"),
        data=base64.b64encode(data).decode("ascii"),
        imports=json.dumps({"imports": {n: data_uri(p.read_bytes(), "text/javascript") for n, p in MODULES.items()}}),
        style=(FOLDER / "page_files" / "view.css").read_text(encoding="utf-8"),
        script=(FOLDER / "page_files" / "app.js").read_text(encoding="utf-8"),
        generator=GENERATOR,
        version=__version__,
        three=VERSION,
    )


def notices(run: LoadedRun) -> list[str]:
    """Notices on an incomplete or rejected run."""
    status = run.manifest.status
    found = [] if status in ("", "completed") else [f"This run is incomplete: {status}."]
    return found + (
        ["Not compared with the experiment: " + "; ".join(run.summary.refused)] if run.summary.refused else []
    )


def has_curve_time(run: LoadedRun, time: np.ndarray) -> bool:
    """Tell whether ``time`` (k,) [ms] of the frames is the time of the curve, unlike in a static test."""
    columns = run.curve
    return "time_ms" in columns and len(time) > 1 and bool(time[-1] <= columns["time_ms"].max() * 1.01)


def _curve(run: LoadedRun, time: np.ndarray) -> dict[str, Any]:
    """Curve of the run for ``time`` (k,) [ms] of the frames, and whether both have the same time."""
    axes = run.report.axes if run.report else None
    columns, in_time = run.curve, has_curve_time(run, time)
    if not in_time or axes is None or not {axes.x, axes.y} <= set(columns):
        return {"timed": in_time, "curve": None}
    t, x, y = (columns[name] for name in ("time_ms", axes.x, axes.y))
    known = np.isfinite(t) & np.isfinite(x) & np.isfinite(y)
    t, x, y = t[known], x[known], y[known]
    if len(t) < 2 or np.ptp(x) == 0.0:
        return {"timed": in_time, "curve": None}
    kept = np.unique(
        [*np.linspace(0, len(t) - 1, CURVE_POINTS).astype(int), *np.searchsorted(t, time).clip(max=len(t) - 1)]
    )
    t, x, y = t[kept], x[kept], y[kept]
    low, high = min(0.0, float(y.min())), max(0.0, float(y.max()))
    across = WIDE * (x - x.min()) / np.ptp(x)
    down = HIGH * (high - y) / ((high - low) or 1.0)
    place = np.round(np.column_stack([across, down]), 1).tolist()
    curve = {"xlabel": axes.xlabel, "ylabel": axes.ylabel, "place": place}
    return {"timed": True, "curve": curve | {k: np.round(v, 6).tolist() for k, v in (("time", t), ("x", x), ("y", y))}}
