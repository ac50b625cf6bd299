"""A finished specimen as arrays, so that an interrupted ensemble goes on with the next one."""

import json
from dataclasses import asdict
from typing import Any

import numpy as np

from knittest.base.history import Cost, History, Mesh, Overlaps, Quality, Specimen
from knittest.models.snapshot import State, arrays_of, entry, prefixed, under
from knittest.solve.state import frame_of, frame_state

MESH_ARRAYS = ("cells", "part", "yarn", "radius")


def specimen_state(specimen: Specimen, frames: bool) -> State:
    """``specimen`` as arrays; ``frames`` only where they will be shown."""
    history, mesh = specimen.history, specimen.history.mesh
    n_frames = len(history.frames) if frames else 0
    plain = {
        "kind": mesh.kind,
        "part_names": mesh.part_names,
        "first_failure": history.first_failure,
        "overlaps": asdict(history.overlaps),
        "n_frames": n_frames,
        "peak": history.peak if frames else None,
        "results": specimen.results,
        "quality": asdict(specimen.quality),
        "cost": asdict(specimen.cost),
        "facts": specimen.facts,
        "rest": specimen.rest,
    }
    state = {"plain": np.array(json.dumps(plain, default=_plain))} | arrays_of("mesh", mesh, MESH_ARRAYS)
    state |= prefixed("curve", history.curve) | prefixed("energies", history.energies)
    state |= prefixed("yarns", specimen.yarns) | prefixed("contacts", history.contacts)
    state |= arrays_of("history", history, ("tool_force",))
    for k in range(n_frames):
        state |= prefixed(f"frame-{k:04d}", frame_state(history.frames[k]))
    return state


def specimen_of(state: State) -> Specimen:
    """Specimen that :func:`specimen_state` was made of."""
    plain = json.loads(str(entry(state, "plain")))
    arrays = {name: entry(state, f"mesh/{name}") for name in MESH_ARRAYS}
    mesh = Mesh(plain["kind"], part_names=tuple(plain["part_names"]), **arrays)
    frames = [frame_of(under(state, f"frame-{k:04d}")) for k in range(plain["n_frames"])]
    overlaps = Overlaps(**(plain["overlaps"] | {"worst": tuple(plain["overlaps"]["worst"])}))
    history = History(
        mesh, under(state, "curve"), under(state, "energies"), frames, plain["first_failure"],
        under(state, "contacts"), entry(state, "history/tool_force"), overlaps, plain.get("peak"),
    )  # fmt: skip
    lists = {name: tuple(plain["quality"][name]) for name in ("failures", "warnings")}
    quality = Quality(**(plain["quality"] | lists))
    return Specimen(
        history, plain["results"], quality, Cost(**plain["cost"]), under(state, "yarns"), plain["facts"], plain["rest"]
    )


def _plain(value: Any) -> Any:
    """A numpy number as Python's."""
    return value.item()
