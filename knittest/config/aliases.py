"""Old names of config fields and parameter sets. They are read for one more version, with a warning."""

import sys
import warnings
from collections.abc import Callable, Mapping
from typing import Any

from knittest.base.errors import InputError

KeyPath = tuple[str | int, ...]
#: version that no longer reads them
END = "0.4"
#: present name of each old field by the part of the config that holds it; "" is the top level of the file of a study
FIELDS: dict[tuple[str, str], str] = {
    ("knitting", "draw_in"): "loop_shortening",
    ("rig", "across"): "transverse",
    ("rig", "bent"): "bent_yarns",
    ("rig", "clamped"): "clamped_edges",
    ("rig", "judged_from"): "evaluated_from",
    ("rig", "slide"): "max_slip",
    ("rig", "torn"): "at_fracture",
    ("rig", "turns"): "reversal_angles",
    ("holder", "drag"): "damping_rate",
    ("solver", "max_beyond_law"): "max_law_extrapolation",
    ("solver", "max_drag"): "max_damping_force",
    ("solver", "max_force_free"): "max_force_free_overlap",
    ("", "differ"): "differing_fields",
    ("", "shorter"): "shorter_ends",
}
#: present name of each old parameter set of a fabric
PARAMETER_SETS = {"gripping": "spin-friction"}
#: present name of each old number of summary.json
RESULTS = {"draw_in_pct": "loop_shortening_pct"}
#: old fields as a list of fields names them; any other text with dots may be a file
_HOLDERS = {"knitting": "fabric.knitting", "holder": "rig.holder"}
_OLD_PATHS = {f"{_HOLDERS.get(holder, holder)}.{name}" for holder, name in FIELDS if holder}


class OldNameWarning(FutureWarning):
    """A config or a command uses a name that the next version no longer reads."""


def warn_of_old_name(where: str, old: str, new: str) -> None:
    """Warn that ``old``, stated at ``where`` (a file with its line, or an option), is now called ``new``.

    The warning is placed at the first caller outside knittest.
    """
    text = f"{where}: {old} is now called {new}; write {new}, because version {END} does not read the old name"
    frame, level = sys._getframe(), 1
    while frame.f_back is not None and frame.f_globals.get("__name__", "").startswith("knittest."):
        frame, level = frame.f_back, level + 1
    warnings.warn(text, OldNameWarning, stacklevel=level)


def present_field(name: str) -> str:
    """Present name of the field with the dotted ``name``, without a warning: for files of an earlier version."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OldNameWarning)
        return ".".join(map(str, present_path(tuple(name.split(".")), "")))


def present_path(path: KeyPath, where: str) -> KeyPath:
    """``path`` of a field with present names; warns of an old one, stated at ``where``."""
    found: KeyPath = path[:1]
    for part in path[1:]:
        found = (*found, _present_name(found, part))
    if found != path:
        warn_of_old_name(where, ".".join(map(str, path)), ".".join(map(str, found)))
    return found


def present_results(numbers: Any) -> Any:
    """Numbers of a summary.json with present names, without a warning; anything else as it is."""
    return {RESULTS.get(key, key): value for key, value in numbers.items()} if isinstance(numbers, dict) else numbers


def present_fields(name: str) -> list[str]:
    """Present paths of the old field ``name``, which may lack its holders; empty for any other name."""
    paths = {f"{_HOLDERS.get(holder, holder)}.{old}": (holder, new) for (holder, old), new in FIELDS.items()}
    found = [held for old, held in paths.items() if f".{old}".endswith(f".{name}")]
    return [f"{_HOLDERS.get(holder, holder)}.{new}".removeprefix(".") for holder, new in found]


def present_set(name: str, sets: Mapping[str, object], where: str) -> str:
    """Name of the parameter set ``name`` among ``sets``, those of a fabric.

    Warns of an old name, stated at ``where`` or in the fabric.
    """
    for old, present in PARAMETER_SETS.items():
        if name in (old, present) and name not in sets and (found := present if name == old else old) in sets:
            warn_of_old_name(where if name == old else "the fabric file", f"parameter set {old}", present)
            return found
    return name


def present_names(
    data: dict[str, Any], lines: Mapping[KeyPath, int], source: str
) -> tuple[dict[str, Any], dict[KeyPath, int]]:
    """``data`` and ``lines`` of the file ``source`` with present names of fields, also of those named with dots.

    Raises :class:`InputError` for a field that has its old and its present name in one mapping.
    """
    moved: dict[KeyPath, KeyPath] = {(): ()}
    found = _renamed(data, (), (), lambda path: f"{source}:{lines.get(path, 1)}", moved)
    return found, {moved[path]: line for path, line in lines.items()}


def present_value(value: Any, path: KeyPath, where: str) -> Any:
    """``value`` of the field at ``path`` with present names of the fields in it; ``where`` as :func:`present_path`."""
    return _renamed(value, (), path, lambda _: where, {(): ()})


def _renamed(
    value: Any, at: KeyPath, above: KeyPath, where: Callable[[KeyPath], str], moved: dict[KeyPath, KeyPath]
) -> Any:
    """``value`` at ``at``, below the fields ``above``; ``moved`` takes the present path of each path in it."""
    if isinstance(value, list):
        moved |= {(*at, number): (*moved[at], number) for number in range(len(value))}
        return [_renamed(inner, (*at, number), above, where, moved) for number, inner in enumerate(value)]
    if not isinstance(value, dict):
        is_field = isinstance(value, str) and value in _OLD_PATHS and isinstance(at[-1] if at else None, int)
        return ".".join(map(str, present_path(tuple(value.split(".")), where(at)))) if is_field else value
    found: dict[Any, Any] = {}
    for name, inner in value.items():
        path, present = (*at, name), name
        if isinstance(name, str) and "." in name:
            present = ".".join(map(str, present_path(tuple(name.split(".")), where(path))))
        elif (present := _present_name((*above, *moved[at]), name)) != name:
            warn_of_old_name(where(path), name, present)
        if present in found or (present != name and present in value):
            raise InputError(f"{where(path)}: {name} is the old name of {present}, which is stated too: keep {present}")
        moved[path] = (*moved[at], present)
        found[present] = _renamed(inner, path, above, where, moved)
    return found


def _present_name(holders: KeyPath, name: Any) -> Any:
    """``name`` of a field in ``holders``; what a fabric states below ``rigs`` are fields of a rig."""
    parts = [part for one in holders if isinstance(one, str) for part in one.split(".")]
    holder = "rig" if "rigs" in parts else parts[-1] if parts else ""
    present = FIELDS.get((holder, name), name) if isinstance(name, str) else name
    return name if present != name and holder == "rig" and _is_field_of_a_rig(name) else present


def _is_field_of_a_rig(name: str) -> bool:
    """Tell whether a test, such as one of another package, has a field ``name`` of its rig today."""
    from knittest.config.run import RUNS  # it reads YAML by this module

    rigs: list[Any] = [run.model_fields["rig"].annotation for run in RUNS.values()]
    return any(name in rig.model_fields for rig in rigs)
