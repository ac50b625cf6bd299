"""Old names of config fields and parameter sets. They are read for one more version, with a warning."""

import warnings
from collections.abc import Mapping
from typing import Any

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


class OldNameWarning(FutureWarning):
    """A config or a command uses a name that the next version no longer reads."""


def warn_of_old_name(where: str, old: str, new: str) -> None:
    """Warn that ``old``, stated at ``where`` (a file with its line, or an option), is now called ``new``."""
    text = f"{where}: {old} is now called {new}; write {new}, because version {END} does not read the old name"
    warnings.warn(text, OldNameWarning, stacklevel=2)


def present_path(path: KeyPath, where: str) -> KeyPath:
    """``path`` of a field with present names; warns of an old one, stated at ``where``."""
    found: KeyPath = ()
    for part in path:
        found = (*found, _present_name(found, part))
    if found != path:
        warn_of_old_name(where, ".".join(map(str, path)), ".".join(map(str, found)))
    return found


def present_set(name: str, sets: Mapping[str, object], where: str) -> str:
    """Name of the parameter set ``name`` among those of a fabric; warns of an old one, stated at ``where``."""
    present = PARAMETER_SETS.get(name)
    if present is None or name in sets or present not in sets:
        return name
    warn_of_old_name(where, f"parameter set {name}", present)
    return present


def present_names(
    data: dict[str, Any], lines: Mapping[KeyPath, int], source: str
) -> tuple[dict[str, Any], dict[KeyPath, int]]:
    """``data`` and ``lines`` of the file ``source`` with present names of fields, also of those named with dots."""
    moved: dict[KeyPath, KeyPath] = {(): ()}

    def read(value: Any, at: KeyPath) -> Any:
        if isinstance(value, dict):
            return {key(name, at): read(inner, (*at, name)) for name, inner in value.items()}
        if isinstance(value, list):
            return [read(inner, (*at, key(number, at))) for number, inner in enumerate(value)]
        return dotted(value, at) if isinstance(value, str) else value

    def key(name: Any, at: KeyPath) -> Any:
        path = (*at, name)
        present = dotted(name, path) if isinstance(name, str) and "." in name else _present_name(moved[at], name)
        if present != name and "." not in name:
            warn_of_old_name(f"{source}:{lines.get(path, 1)}", name, present)
        moved[path] = (*moved[at], present)
        return present

    def dotted(text: str, at: KeyPath) -> str:
        present = present_path(tuple(text.split(".")), f"{source}:{lines.get(at, 1)}") if "." in text else (text,)
        return ".".join(map(str, present))

    found = read(data, ())
    return found, {moved[path]: line for path, line in lines.items()}


def _present_name(holders: KeyPath, name: Any) -> Any:
    """``name`` of a field in ``holders``; what a fabric states below ``rigs`` are fields of a rig."""
    holder = "rig" if "rigs" in holders else holders[-1] if holders else ""
    return FIELDS.get((str(holder), name), name) if isinstance(name, str) else name
