"""Files of a config: fabric file with parameter sets, data files, name conflicts with shipped files."""

import re
import stat
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError
from knittest.base.files import configs_dir, data_dir, variants
from knittest.config.aliases import OldNameWarning, present_set
from knittest.config.fabric import Fabric
from knittest.config.messages import unknown_name_text
from knittest.config.run import Run
from knittest.config.settings import Layers
from knittest.config.tools import stl_tools
from knittest.config.yaml_loader import Document, KeyPath, describe, dotted_path, load_yaml, value_excerpt


def find_name_conflict(shipped: Path, others: Iterable[Path]) -> Path | None:
    """First of ``others`` that exists, is not ``shipped`` itself, and has other contents."""
    for other in others:
        if not other.exists() or other.samefile(shipped):
            continue
        if _contents(other) not in ({}, _contents(shipped)):
            return other.resolve()
    return None


def _contents(path: Path) -> dict[Path, bytes]:
    """Contents of a file, or of the tables and imported curves in the folder of an experiment."""
    files = [*path.glob("*.csv"), *path.glob("*/corridor.csv")] if path.is_dir() else [path]
    return {file.relative_to(path): file.read_bytes() for file in files if file.is_file()}


#: the paper's two variants by number
NUMBERED = {"1": "pham2019-v1", "2": "pham2019-v2"}
DEFAULT_SET = "calibrated"
SETS = "parameter_sets"
#: fields at the top of the file of a test or a run, and of a fabric file
RUN_FIELDS, FABRIC_FIELDS = frozenset(Run.model_fields), frozenset({*Fabric.model_fields, SETS})
#: name in a run of the numbers of a fabric without sets
BASE = "base"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,39}$")


def parameter_set_text(parameters: str) -> str:
    """Name of a parameter set for messages."""
    return "as in the fabric file" if parameters == BASE else parameters


@dataclass(frozen=True)
class FabricSource:
    """Mapping of fabric fields at ``root`` of ``document``; ``inline`` if it is part of a run config."""

    document: Document
    root: KeyPath
    folder: Path
    inline: bool

    @property
    def fields(self) -> Any:
        """Fabric fields as written, parameter sets included."""
        return self.document.data["fabric"] if self.inline else self.document.data


def fabric_file(path: Path) -> FabricSource:
    """Fabric in a fabric file; raises :class:`InputError` also for a file with a test."""
    document = load_yaml(path)
    if RUN_FIELDS & document.data.keys() and not FABRIC_FIELDS & document.data.keys():
        raise InputError(f"{path}: this is the file of a test, not a fabric file: give it as --config {path}")
    return FabricSource(document, (), path.resolve().parent, inline=False)


def test_file(path: Path) -> Document:
    """Config of a test or a whole run in a file; raises :class:`InputError` also for a fabric file."""
    document = load_yaml(path)
    if FABRIC_FIELDS & document.data.keys() and not RUN_FIELDS & document.data.keys():
        raise InputError(f"{path}: this is a fabric file, not the file of a test: give it as --fabric {path}")
    return document


def variant_path(variant: str) -> Path:
    """File of a shipped fabric or of one in ``./configs`` or ``./configs/fabrics``; raises :class:`InputError`."""
    name = NUMBERED.get(variant, variant)
    if not NAME.match(name):
        raise InputError(
            f"--variant {variant!r}: expected 1, 2 or a name of letters, digits, '.', '_', '-'; "
            "give a path with --fabric"
        )
    folders = (configs_dir() / "fabrics", Path("configs"), Path("configs/fabrics"))
    for folder in folders:
        if (path := folder / f"{name}.yaml").is_file():
            other = find_name_conflict(path, (place / path.name for place in folders if place != folder))
            if variant not in NUMBERED and other is not None:
                raise InputError(
                    f"--variant {variant}: found two different fabrics, {other} and {path}: give the path of one of "
                    "them with --fabric"
                )
            return path
    known = [*NUMBERED, *sorted({p.stem for folder in folders for p in folder.glob("*.yaml") if _is_fabric(p)})]
    raise InputError(f"--variant {variant}: {unknown_name_text(variant, known, 'fabric')}; give a path with --fabric")


def _is_fabric(path: Path) -> bool:
    """Tell whether a file holds a fabric and not a rig or a run; a broken file may."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", OldNameWarning)  # of a file that no run reads
            return "name" in load_yaml(path).data
    except InputError:
        return True


def lay_fabric(layers: Layers, source: FabricSource, wanted: str | None) -> str:
    """Lay the fabric with its parameter set ``wanted`` (default ``calibrated``); return the name of the set."""
    document, fields = source.document, source.fields
    if not isinstance(fields, dict):
        raise InputError(
            f"{document.place_of(source.root)}: fabric: expected a mapping of fields, found {describe(fields)}"
        )
    base = {key: value for key, value in fields.items() if key != SETS}
    layers.lay(base, lambda path: document.place_of(source.root + path[1:]), ("fabric",))
    if SETS not in fields:
        if wanted is not None and not (source.inline and wanted == document.data.get("parameters")):
            raise InputError(
                f"{document.place_of(source.root)}: --parameters {wanted}: the fabric has no {SETS}: leave out "
                f"--parameters, or add {SETS}: {{{wanted}: {{...}}}} to the file"
            )
        return wanted or BASE
    sets, name, at = fields[SETS], wanted or DEFAULT_SET, (*source.root, SETS)
    if not isinstance(sets, dict) or not sets:
        raise InputError(f"{document.place_of(at)}: {SETS}: expected a mapping of named sets, found {describe(sets)}")
    name = present_set(name, sets, f"--parameters {name}")
    if name not in sets:
        raise InputError(
            f"{document.place_of(at)}: parameters = {name}: {unknown_name_text(name, list(sets), 'parameter set')}"
        )
    at = (*at, name)
    if not isinstance(sets[name], dict | None):
        raise InputError(
            f"{document.place_of(at)}: {name}: expected a mapping of fabric fields, found {describe(sets[name])}"
        )
    layers.lay(sets[name] or {}, lambda path: document.place_of(at + path[1:]), ("fabric",))
    return name


def resolve_data_paths(run: Run, layers: Layers, folders: Sequence[Path]) -> Run:
    """Check the data paths of ``run`` and make those outside the data folder absolute.

    ``folders``: those of the fabric file and of the config. Raises :class:`InputError` for a path that leaves these
    folders, is no regular file (or folder, for ``experiment``), is ambiguous between a user's and a different shipped
    file, or does not exist though the run needs it, and for an experiment without rows of the fabric's variant.
    """
    here = Path.cwd().resolve()
    own = (here / "data").resolve()
    roots = [data_dir().resolve(), *(f.resolve() for f in folders), *([own] if own.is_relative_to(here) else []), here]
    fabric = run.fabric
    macro, needed = fabric.macro, run.model.scale == "macro"
    at: KeyPath = ("fabric", "macro")
    if macro.tension is not None:
        tension = {
            d: _settle_path(one, (*at, "tension", d), layers, roots, needed) if isinstance(one, str) else one
            for d, one in macro.tension.items()
        }
        macro = macro.model_copy(update={"tension": tension})
    experiment = fabric.experiment
    if experiment is not None:
        experiment = _settle_path(experiment, ("fabric", "experiment"), layers, roots, needed=True, is_folder=True)
        path, variant = ("fabric", "experiment_variant"), str(fabric.experiment_variant)
        if variant not in (known := variants(roots[0] / experiment)):
            raise InputError(
                f"{layers.place_of(path)}: {dotted_path(path)} = {value_excerpt(variant)}: expected one of "
                f"{', '.join(known)}, which "
                f"{roots[0] / experiment} has"
            )
    for name, law in (("biaxial", macro.biaxial), ("shear", macro.shear)):
        if law is not None and law.curve is not None:
            settled = _settle_path(law.curve, (*at, name, "curve"), layers, roots, needed)
            macro = macro.model_copy(update={name: law.model_copy(update={"curve": settled})})
    tools = {}
    for name, stl in stl_tools(run.rig).items():
        file = _settle_path(stl.path, ("rig", name, "stl", "path"), layers, roots, needed=True)
        tools[name] = getattr(run.rig, name).model_copy(update={"stl": stl.model_copy(update={"path": file})})
    fabric = fabric.model_copy(update={"macro": macro, "experiment": experiment})
    return run.model_copy(update={"fabric": fabric, "rig": run.rig.model_copy(update=tools)})


def _settle_path(
    text: str, path: KeyPath, layers: Layers, roots: list[Path], needed: bool, is_folder: bool = False
) -> str:
    def refuse(expectation: str) -> InputError:
        return InputError(
            f"{layers.place_of(path) or 'defaults'}: {dotted_path(path)} = {value_excerpt(text)}: {expectation}"
        )

    if not text or "\0" in text:
        raise refuse("expected a path")
    for root in roots:
        found = (root / text).resolve()
        if not any(found.is_relative_to(allowed) for allowed in roots):
            raise refuse("expected a path in the data folder, the folder of the config or the working folder")
        try:
            mode = found.stat().st_mode
        except OSError:
            continue
        if not (stat.S_ISDIR(mode) if is_folder else stat.S_ISREG(mode)):
            raise refuse(f"expected a {'folder' if is_folder else 'regular file'}")
        if not found.is_relative_to(roots[0]):
            return str(found)
        name = found.relative_to(roots[0])
        own = find_name_conflict(found, (other / name for other in roots[1:]))
        if own is not None and not Path(text).is_absolute():
            raise refuse(
                f"found two different files, {own} and the shipped {found}: rename yours, or give the absolute path of "
                "one of them"
            )
        return name.as_posix() if own is None else str(found)
    if needed:
        raise refuse(f"no such {'folder' if is_folder else 'file'} in {', '.join(map(str, dict.fromkeys(roots)))}")
    return text
