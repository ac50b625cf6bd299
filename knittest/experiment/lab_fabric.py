"""Part of a fabric file that follows from the imported tests."""

import json
from pathlib import Path
from typing import Any

from knittest.base.atomic import write_atomic
from knittest.config.starting import FABRIC
from knittest.experiment.lab_conditions import AREA_MASS, FABRIC_SIDE, FRAME_SIDE, GAUGE, WIDTH
from knittest.experiment.lab_folder import (
    DIRECTIONS,
    SHEAR,
    SOURCE,
    SOURCE_FILE,
    TENSION,
    counted,
    named,
    read_statistics,
)
from knittest.experiment.lab_rigs import rigs_of

FRAME = "picture-frame"
HEAD = """\
# Written by knittest data import, from the tests in this folder: a part of a fabric file.
#   knittest new NAME --from FOLDER
# starts a fabric from it. The next import here writes it anew: edit the fabric, not this file.
"""


def fabric_part(out: Path) -> dict[str, Any]:
    """The fields of :class:`knittest.config.fabric.Fabric` that the imports in ``out`` give."""
    tests, place = read_statistics(out), named(out)
    macro: dict[str, dict[str, Any]] = {}
    for direction in DIRECTIONS:
        if direction in tests:
            macro.setdefault("tension", {})[direction] = (place / direction / TENSION).as_posix()
            macro.setdefault("fracture_strain", {})[direction] = _fracture_strain(tests[direction])
        if f"cantilever-{direction}" in tests:
            macro.setdefault("bending_stiffness", {})[direction] = _stiffness(tests[f"cantilever-{direction}"])
    if FRAME in tests:
        macro["shear"] = _shear(tests[FRAME], (place / FRAME / SHEAR).as_posix())
    own: dict[str, Any] = {"experiment": place.as_posix(), "experiment_variant": out.resolve().name}
    rigs = rigs_of(tests)
    return _area_mass(tests, place) | ({"macro": macro} if macro else {}) | own | ({"rigs": rigs} if rigs else {})


def finish(out: Path) -> None:
    """Write ``fabric.yaml`` to ``out``, and a SOURCE.md if there is none."""
    if not (out / SOURCE_FILE).exists():
        write_atomic(out / SOURCE_FILE, SOURCE)
    write_atomic(out / FABRIC, HEAD + "\n".join(_lines(fabric_part(out), 0)) + "\n")


def _area_mass(tests: dict[str, dict[str, Any]], place: Path) -> dict[str, Any]:
    """The area mass that came with the overhangs, which also made their bending stiffness."""
    bent = {name: t["conditions"][AREA_MASS.key] for name, t in tests.items() if name.startswith("cantilever-")}
    if not bent:
        return {}
    mean = {"mean": sum(bent.values()) / len(bent), "sd": None}
    return {"area_mass": quantity(mean, "measured", f"stated with {place.as_posix()}: {', '.join(bent)}")}


def _fracture_strain(test: dict[str, Any]) -> dict[str, Any]:
    conditions = test["conditions"]
    gauge = f", {conditions[GAUGE.key]:g} mm between the clamps" if GAUGE.key in conditions else ""
    strips = counted(test["fracture_strain_pct"]["n"], "strip")
    width = f"{conditions[WIDTH.key]:g} mm"
    return quantity(test["fracture_strain_pct"], "measured", f"{strips}, {width} wide{gauge}; an input of the shells")


def _stiffness(test: dict[str, Any]) -> dict[str, Any]:
    """Bending stiffness of the shells, by Eq. 2, from each strip's overhang."""
    found, overhang = test["bending_stiffness_n_mm_per_width"], test["overhang_mm"]
    mass = test["conditions"][AREA_MASS.key]
    of = f"{counted(found['n'], 'strip')}, overhang {overhang['mean']:.4g} mm, {mass:g} g/m2"
    return quantity(found, "derived", f"area mass x g x (overhang / 2)^3; {of}")


def _shear(test: dict[str, Any], curve: str) -> dict[str, Any]:
    frame, fabric = (test["conditions"][side.key] for side in (FRAME_SIDE, FABRIC_SIDE))
    count = next(value["n"] for name, value in test.items() if name.startswith("shear_force_n_at_deg"))
    ref = f"{counted(count, 'picture frame')} of {frame:g} mm, fabric of {fabric:g} mm"
    return {"kind": "table", "curve": curve, "source": "measured", "ref": ref}


def quantity(found: dict[str, Any], source: str, ref: str) -> dict[str, Any]:
    """A field of a fabric file, with the standard deviation where one is known."""
    scatter = {} if found["sd"] is None else {"sd": float(f"{found['sd']:.6g}")}
    return {"value": float(f"{found['mean']:.6g}"), **scatter, "source": source, "ref": ref}


def _lines(part: dict[str, Any], level: int) -> list[str]:
    """YAML of nested mappings; what has a value or a kind stands in one line, as in the shipped fabrics."""
    found = []
    for name, value in part.items():
        if isinstance(value, dict) and not {"value", "kind"} & set(value):
            found += [f"{'  ' * level}{name}:", *_lines(value, level + 1)]
        else:
            flow = (
                "{" + ", ".join(f"{k}: {json.dumps(v, ensure_ascii=False)}" for k, v in value.items()) + "}"
                if isinstance(value, dict)
                else json.dumps(value, ensure_ascii=False)
            )
            found.append(f"{'  ' * level}{name}: {flow}")
    return found
