"""Data paths of a config: in the data folder, the config's own, ./data or the working folder, never out of them."""

import stat
from collections.abc import Sequence
from pathlib import Path

from knittest.base.errors import InputError
from knittest.base.resources import data_dir
from knittest.base.tidy_tables import variants
from knittest.config.layers import Layers
from knittest.config.namesakes import namesake
from knittest.config.rigs import Rig
from knittest.config.run import Run
from knittest.config.tools import stl_tools
from knittest.config.yaml_loader import KeyPath, dotted, shown


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
