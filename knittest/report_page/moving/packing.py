"""Recordings as few bytes: whole numbers, their differences in time and along the nodes, deflated.

A frame differs little from the one before it, and by almost as much as at the next node: what is left of the second
difference mostly fits a byte, most of them alike.
"""

import zlib
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from knittest.base.history import Body
from knittest.report_page.moving.recording import Array, Recording
from knittest.report_page.moving.scales import Scale

#: whole numbers of a position: 16 bits
STEPS = 65535


@dataclass
class Packer:
    """Arrays one after the other in ``data``; :meth:`add` tells where each is and of what shape."""

    data: bytearray = field(default_factory=bytearray)

    def add(self, values: NDArray[np.integer], width: int) -> dict[str, Any]:
        """Add whole ``values`` (k, n, d) of ``width`` bytes (1, 2 or 4); returns the entry that finds them again."""
        entry = {"at": len(self.data), "width": width, "shape": list(values.shape)}
        self.data += packed(values, width)
        return entry

    def deflated(self) -> bytes:
        """All of them, in zlib's format."""
        return zlib.compress(bytes(self.data), 9)


def packed(values: NDArray[np.integer], width: int) -> bytes:
    """Bytes of whole ``values`` (k, n, d): differences along the first two axes, folded to small positive numbers, all
    low bytes first.
    """
    bits = 8 * width
    rest: Any = np.diff(np.diff(values.astype(np.int64), axis=0, prepend=0), axis=1, prepend=0)
    rest = ((rest + (1 << (bits - 1))) & ((1 << bits) - 1)) - (1 << (bits - 1))
    folded = np.moveaxis((rest << 1) ^ (rest >> (bits - 1)), 2, 0).ravel() & ((1 << bits) - 1)
    return b"".join(((folded >> (8 * k)) & 255).astype(np.uint8).tobytes() for k in range(width))


def unpacked(data: bytes, entry: dict[str, Any]) -> NDArray[np.int64]:
    """Values of an ``entry`` of :meth:`Packer.add` from inflated ``data``, as the page takes them out."""
    (k, n, d), width = entry["shape"], entry["width"]
    planes = np.frombuffer(data, np.uint8, width * k * n * d, entry["at"]).reshape(width, d, k, n).astype(np.int64)
    folded = sum((plane << (8 * b) for b, plane in enumerate(planes)), np.zeros((d, k, n), np.int64))
    rest = np.moveaxis((folded >> 1) ^ -(folded & 1), 0, 2)
    values: NDArray[np.int64] = np.cumsum(np.cumsum(rest, axis=1), axis=0) & ((1 << (8 * width)) - 1)
    return values


def whole_positions(position: Array) -> tuple[NDArray[np.int64], Array, float]:
    """Positions (..., 3) [mm] in steps of one size from their least corner (3,); no error exceeds half a step [mm]."""
    low = position.reshape(-1, 3).min(axis=0)
    step = float(np.ptp(position.reshape(-1, 3), axis=0).max()) / STEPS or 1.0
    return np.round((position - low) / step).astype(np.int64), low, step


def packed_recording(recording: Recording, scales: dict[str, Scale]) -> tuple[dict[str, Any], bytes]:
    """Header that JSON can hold and deflated numbers, as the page's script reads them."""
    packer = Packer()
    values, low, step = whole_positions(recording.position)
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
        "bodies": [_body(body, packer) for body in recording.bodies],
    }
    return header, packer.deflated()


def _body(body: Body, packer: Packer) -> dict[str, Any]:
    values, low, step = whole_positions(body.points)
    return {
        "name": body.name,
        "low": low.tolist(),
        "step": step,
        "points": packer.add(values[None], 2),
        "triangles": packer.add(body.triangles[None], 4),
        "offset": np.round(body.offset, 5).tolist(),
        "turn": None if body.turn is None else np.round(body.turn.reshape(-1, 9), 7).tolist(),
    }
