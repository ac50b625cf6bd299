"""Files of a config: the fabric file with its parameter sets, name conflicts with shipped files, paths of data."""

import re
import stat
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError
from knittest.base.files import configs_dir, data_dir, variants
from knittest.config.messages import unknown
from knittest.config.rigs import Rig
from knittest.config.run import Run
from knittest.config.settings import Layers
from knittest.config.tools import stl_tools
from knittest.config.yaml_loader import Document, KeyPath, describe, dotted, load_yaml, shown


def namesake(shipped: Path, others: Iterable[Path]) -> Path | None:
    """The first of ``others`` that exists, is not ``shipped`` itself, and has other contents."""
    for other in others:
        if not other.exists() or other.samefile(shipped):
            continue
        if _read(other) not in ({}, _read(shipped)):
            return other.resolve()
    return None


def _read(path: Path) -> dict[Path, bytes]:
    """Contents of a file, or of what an experiment is read from in a folder: its tables, and curves of imports."""
    files = [*path.glob("*.csv"), *path.glob("*/corridor.csv")] if path.is_dir() else [path]
    return {file.relative_to(path): file.read_bytes() for file in files if file.is_file()}


#: the paper's two variants by number
NUMBERED = {"1": "pham2019-v1", "2": "pham2019-v2"}
DEFAULT_SET = "calibrated"
SETS = "parameter_sets"
#: what a run states of a fabric that has no sets
BASE = "base"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,39}$")


def numbers_of(parameters: str) -> str:
    """Name of a parameter set for a reader; that of a fabric without any says so."""
    return "as in the fabric file" if parameters == BASE else parameters


@dataclass(frozen=True)
class FabricSource:
    """A mapping of fabric fields at ``root`` of ``document``; ``inline`` when a run config holds it."""

    document: Document
    root: KeyPath
    folder: Path
    inline: bool

    @property
    def fields(self) -> Any:
        """The fabric fields as written, parameter sets included."""
        return self.document.data["fabric"] if self.inline else self.document.data


def fabric_file(path: Path) -> FabricSource:
    """The fabric in a file of its own."""
    return FabricSource(load_yaml(path), (), path.resolve().parent, inline=False)


def variant_path(variant: str) -> Path:
    """File of a shipped fabric or of one in ``./configs`` or ``./configs/fabrics``; :class:`InputError` if none."""
    name = NUMBERED.get(variant, variant)
    if not NAME.match(name):
        raise InputError(
            f"--variant {variant!r}: expected 1, 2 or a name of letters, digits, '.', '_', '-'; "
            "give a path with --fabric"
        )
    folders = (configs_dir() / "fabrics", Path("configs"), Path("configs/fabrics"))
    for folder in folders:
        if (path := folder / f"{name}.yaml").is_file():
            _refuse_namesake(variant, path, [other / path.name for other in folders if other != folder])
            return path
    known = [*NUMBERED, *sorted({p.stem for folder in folders for p in folder.glob("*.yaml") if _is_fabric(p)})]
    raise InputError(f"--variant {variant}: {unknown(variant, known, 'fabric')}; give a path with --fabric")


def _refuse_namesake(variant: str, path: Path, others: list[Path]) -> None:
    """Raise :class:`InputError` where two fabrics have the name that was asked for; a number is one of the paper's."""
    if variant not in NUMBERED and (other := namesake(path, others)) is not None:
        raise InputError(
            f"--variant {variant}: {other} and {path} differ: expected one fabric of this name: give the path of the "
            "one that is meant with --fabric"
        )


def _is_fabric(path: Path) -> bool:
    """Tell whether a file holds a fabric, not a rig or a whole run; a broken one may."""
    try:
        return "name" in load_yaml(path).data
    except InputError:
        return True


def lay_fabric(layers: Layers, source: FabricSource, wanted: str | None) -> str:
    """Lay the fabric with its parameter set ``wanted`` (default ``calibrated``); return the name of the set.

    A fabric without sets is taken as it stands: the set is called ``base``, or as the resolved run around it says.
    """
    document, fields = source.document, source.fields
    if not isinstance(fields, dict):
        raise InputError(
            f"{document.where(source.root)}: fabric: expected a mapping of fields, found {describe(fields)}"
        )
    base = {key: value for key, value in fields.items() if key != SETS}
    layers.lay(base, lambda path: document.where(source.root + path[1:]), ("fabric",))
    if SETS not in fields:
        label_only = source.inline and wanted == document.data.get("parameters")
        if wanted is not None and not label_only:
            where = document.where(source.root)
            raise InputError(
                f"{where}: --parameters {wanted}: the fabric has no {SETS}, only one set of numbers: leave "
                f"--parameters away, or add {SETS}: {{{wanted}: {{...}}}} to the file"
            )
        return wanted or BASE
    at = (*source.root, SETS)
    name = _chosen_set(document, fields[SETS], at, wanted)
    at = (*at, name)
    overrides = fields[SETS][name]
    if not isinstance(overrides, dict | None):
        raise InputError(
            f"{document.where(at)}: {name}: expected a mapping of fabric fields, found {describe(overrides)}"
        )
    layers.lay(overrides or {}, lambda path: document.where(at + path[1:]), ("fabric",))
    return name


def _chosen_set(document: Document, sets: object, at: KeyPath, wanted: str | None) -> str:
    if not isinstance(sets, dict) or not sets:
        raise InputError(f"{document.where(at)}: {SETS}: expected a mapping of named sets, found {describe(sets)}")
    name = wanted or DEFAULT_SET
    if name not in sets:
        raise InputError(f"{document.where(at)}: parameters = {name}: {unknown(name, list(sets), 'parameter set')}")
    return name


def settle_data_paths(run: Run, layers: Layers, folders: Sequence[Path]) -> Run:
    """Check the data paths of ``run`` and make those outside the data folder absolute.

    ``folders``: of the fabric's file and of the config. Raises :class:`InputError` for a path that leaves these
    folders, is no regular file (or folder, for ``experiment``), means one of the user's and a shipped one that differs,
    or, where the run needs it, does not exist, and for an experiment without rows of the fabric's variant.
    """
    here = Path.cwd().resolve()
    own = (here / "data").resolve()
    roots = [data_dir().resolve(), *(f.resolve() for f in folders), *([own] if own.is_relative_to(here) else []), here]
    fabric = run.fabric
    macro, needed = fabric.macro, run.model.scale == "macro"
    if macro.tension is not None:
        at: KeyPath = ("fabric", "macro", "tension")
        tension = {
            d: _settled(one, (*at, d), layers, roots, needed) if isinstance(one, str) else one
            for d, one in macro.tension.items()
        }
        macro = macro.model_copy(update={"tension": tension})
    experiment = fabric.experiment
    if experiment is not None:
        experiment = _settled(experiment, ("fabric", "experiment"), layers, roots, needed=True, is_folder=True)
        _check_variant(str(fabric.experiment_variant), roots[0] / experiment, layers)
    if macro.shear is not None and macro.shear.curve is not None:
        settled = _settled(macro.shear.curve, ("fabric", "macro", "shear", "curve"), layers, roots, needed)
        macro = macro.model_copy(update={"shear": macro.shear.model_copy(update={"curve": settled})})
    fabric = fabric.model_copy(update={"macro": macro, "experiment": experiment})
    return run.model_copy(update={"fabric": fabric, "rig": _settled_tools(run, layers, roots)})


def _settled_tools(run: Run, layers: Layers, roots: list[Path]) -> Rig:
    changed = {}
    for name, stl in stl_tools(run.rig).items():
        path = _settled(stl.path, ("rig", name, "stl", "path"), layers, roots, needed=True)
        moved = stl.model_copy(update={"path": path})
        changed[name] = getattr(run.rig, name).model_copy(update={"stl": moved})
    return run.rig.model_copy(update=changed)


def _check_variant(variant: str, folder: Path, layers: Layers) -> None:
    known = variants(folder)
    if variant not in known:
        path: KeyPath = ("fabric", "experiment_variant")
        raise InputError(
            f"{layers.where(path)}: {dotted(path)} = {shown(variant)}: no rows of it in {folder}, "
            f"which has {', '.join(known)}"
        )


def _settled(text: str, path: KeyPath, layers: Layers, roots: list[Path], needed: bool, is_folder: bool = False) -> str:
    def refuse(expectation: str) -> InputError:
        return InputError(f"{layers.where(path) or 'defaults'}: {dotted(path)} = {shown(text)}: {expectation}")

    if not text or "\0" in text:
        raise refuse("expected a path")
    for root in roots:
        found = (root / text).resolve()
        if not any(found.is_relative_to(allowed) for allowed in roots):
            raise refuse("the path leaves the data folder, the folder of the config and the working folder")
        try:
            mode = found.stat().st_mode
        except OSError:
            continue
        if not (stat.S_ISDIR(mode) if is_folder else stat.S_ISREG(mode)):
            raise refuse(f"expected a {'folder' if is_folder else 'regular file'}")
        if not found.is_relative_to(roots[0]):
            return str(found)
        name = found.relative_to(roots[0])
        own = namesake(found, (other / name for other in roots[1:]))
        if own is not None and not Path(text).is_absolute():
            raise refuse(
                f"{own} and the shipped {found} differ: expected one file of this name: rename yours, or give the "
                "whole path of the one that is meant"
            )
        return name.as_posix() if own is None else str(found)
    if needed:
        raise refuse(f"no such {'folder' if is_folder else 'file'} in {', '.join(map(str, dict.fromkeys(roots)))}")
    return text
