"""Part of a fabric file that follows from the imported tests."""

import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from knittest.base.atomic import write_atomic
from knittest.config.fabric import Fabric, MacroMaterial
from knittest.config.starting import FABRIC
from knittest.experiment.lab_folder import SOURCE_FILE, read_statistics, source_text
from knittest.experiment.lab_tests import LAB_TESTS, rigs_of

HEAD = """\
# Written by knittest data import, from the tests in this folder: a part of a fabric file.
#   knittest new NAME --from FOLDER
# starts a fabric from it. The next import here writes it anew: edit the fabric, not this file.
"""


def fabric_part(out: Path) -> dict[str, Any]:
    """The fields of :class:`knittest.config.fabric.Fabric` that the imports in ``out`` give, in its order."""
    tests, place = read_statistics(out), Path(*out.parts[1:]) if out.parts[:1] == ("data",) else out
    found: dict[str, Any] = {"experiment": place.as_posix(), "experiment_variant": out.resolve().name}
    macro: dict[str, Any] = {}
    for lab in LAB_TESTS.values():
        part = lab.fabric(tests, place)
        macro |= part.pop("macro", {})
        found |= part
    found |= {"macro": _ordered(macro, MacroMaterial), "rigs": rigs_of(tests)}
    return _ordered({name: value for name, value in found.items() if value}, Fabric)


def _ordered(fields: dict[str, Any], model: type[BaseModel]) -> dict[str, Any]:
    """``fields`` as ``model`` orders them."""
    return {name: fields[name] for name in model.model_fields if name in fields}


def finish(out: Path) -> None:
    """Write ``fabric.yaml`` to ``out``, and a SOURCE.md if there is none."""
    if not (out / SOURCE_FILE).exists():
        write_atomic(out / SOURCE_FILE, source_text())
    write_atomic(out / FABRIC, HEAD + "\n".join(_lines(fabric_part(out), 0)) + "\n")


def _lines(part: dict[str, Any], level: int) -> list[str]:
    """YAML of nested mappings; what has a value or a kind stands in one line, as in the shipped fabrics."""
    found = []
    for name, value in part.items():
        if isinstance(value, dict) and not {"value", "kind"} & set(value):
            found += [f"{'  ' * level}{name}:", *_lines(value, level + 1)]
            continue
        text = json.dumps(value, ensure_ascii=False)
        if isinstance(value, dict):
            text = "{" + ", ".join(f"{k}: {json.dumps(v, ensure_ascii=False)}" for k, v in value.items()) + "}"
        found.append(f"{'  ' * level}{name}: {text}")
    return found
