"""Settings of a run: options and ``--set key.path=value``, layers with the origin of each value."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any

from knittest.base.errors import InputError
from knittest.config.aliases import present_path, present_value
from knittest.config.fields import field_at
from knittest.config.yaml_loader import KeyPath, dotted_path, parse_value, value_excerpt

Where = Callable[[KeyPath], str]


@dataclass
class Layers:
    """Merged ``data`` and the ``origin`` (``file:line`` or option) of every key path in it."""

    data: dict[str, Any] = field(default_factory=dict)
    origin: dict[KeyPath, str] = field(default_factory=dict)

    def lay(self, value: object, where: Where, at: KeyPath = ()) -> None:
        """Lay ``value`` over the one at ``at``: mappings merge, others are replaced; ``where`` gives the origin."""
        old = self.get(at)
        if isinstance(value, dict) and isinstance(old, dict) and not (_is_quantity(value) and _is_quantity(old)):
            if at:
                self.origin.setdefault(at, where(at))
            for key, inner in value.items():
                self.lay(inner, where, (*at, key))
        else:
            self._replace(value, where, at)

    def get(self, path: KeyPath) -> Any:
        """Value at ``path``, ``None`` where there is none."""
        found: Any = self.data
        for part in path:
            if isinstance(found, dict):
                found = found.get(part)
            elif isinstance(found, list | tuple) and isinstance(part, int) and part < len(found):
                found = found[part]
            else:
                return None
        return found

    def place_of(self, path: KeyPath) -> str | None:
        """Origin of ``path`` or of its nearest ancestor; ``None`` for a default."""
        while path and path not in self.origin:
            path = path[:-1]
        return self.origin.get(path)

    def _replace(self, value: object, where: Where, at: KeyPath) -> None:
        for path in [p for p in self.origin if p[: len(at)] == at]:
            del self.origin[path]
        holder: Any = self.data
        for depth, part in enumerate(at[:-1], 1):
            if isinstance(holder, dict) and not isinstance(holder.get(part), dict | list):
                holder[part] = {}
                self.origin[at[:depth]] = where(at)
            holder = holder[part]
        holder[at[-1]] = deepcopy(value)
        self._note(value, where, at)

    def _note(self, value: object, where: Where, at: KeyPath) -> None:
        self.origin[at] = where(at)
        inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        for key, item in inner:
            self._note(item, where, (*at, key))


def _is_quantity(value: dict[str, Any]) -> bool:
    """Tell whether ``value`` is a quantity, which replaces another as a whole with its scatter and source."""
    return "value" in value


@dataclass(frozen=True)
class Setting:
    """Value at ``path`` of the run; ``place`` is the option or the line that states it."""

    path: KeyPath
    value: Any
    place: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", present_path(self.path, self.place))
        if isinstance(self.value, dict | list):
            object.__setattr__(self, "value", present_value(self.value, self.path, self.place))


def parse_set(text: str) -> Setting:
    """Read one ``key.path=value``; the value is YAML. Raises :class:`InputError`."""
    name, equals, value = text.partition("=")
    path: KeyPath = tuple(part.strip() for part in name.split("."))
    if not equals or not all(path):
        raise InputError(f"--set {value_excerpt(text)}: expected key.path=value, such as rig.width=50")
    place = f"--set {name.strip()}"
    return Setting(path, parse_value(value, place), place)


def lay_setting(layers: Layers, setting: Setting) -> None:
    """Lay one setting over ``layers``: a number becomes ``source: user`` with its old sd, null removes a quantity."""
    path, value = _path_in_lists(layers, setting), setting.value
    kind = layers.get(("rig", "kind"))
    field = field_at(path, kind)
    if field and field.is_quantity and not isinstance(value, dict):
        path = (*path, "value")
    holder = field_at(path[:-1], kind)
    if holder and holder.is_quantity and path[-1] == "value" and value is None:
        path = path[:-1]
    elif holder and holder.is_quantity and path[-1] in ("value", "sd"):
        layers.lay(_user_fields(layers.get(path[:-1])), lambda _: setting.place, path[:-1])
    layers.lay(value, lambda _: setting.place, path)


def _path_in_lists(layers: Layers, setting: Setting) -> KeyPath:
    """Path of ``setting`` with the numbers of entries of lists; raises :class:`InputError` for one that is missing."""
    path: KeyPath = ()
    for part in setting.path:
        entries = layers.get(path)
        if isinstance(entries, list) and str(part).isdigit():
            if int(part) >= len(entries):
                raise InputError(
                    f"{setting.place}: {dotted_path(path)} has {len(entries)} entries, counted from 0; expected a "
                    "smaller number"
                )
            part = int(part)
        elif isinstance(entries, list):
            raise InputError(
                f"{setting.place}: {dotted_path(path)} is a list; expected the number of an entry, counted from 0, "
                f"found {part!r}"
            )
        elif path and str(part).isdigit():
            raise InputError(f"{setting.place}: {dotted_path(path)} is not given as a list; expected it in the file")
        path = (*path, part)
    return path


def check_own_yarns(layers: Layers, settings: Sequence[Setting]) -> None:
    """Raise :class:`InputError` where ``settings`` change a yarn that a layer does not have of its own."""
    for setting in settings:
        start, rest = setting.path[:2], setting.path[4:]
        if (
            start != ("fabric", "layers")
            or setting.path[3:4] != ("yarn",)
            or field_at(("fabric", "reinforcing", *rest)) is None
        ):
            continue
        path = _path_in_lists(layers, setting)
        yarn = layers.get(path[:4])
        if rest and isinstance(yarn, dict) and not {"fibre", "linear_density"} & {*yarn}:
            raise InputError(
                f"{setting.place}: layer {path[2]} has no yarn of its own but consists of reinforcing; set "
                f"{dotted_path(('fabric', 'reinforcing', *rest))}, or give the layer a yarn in the fabric file"
            )


def refuse_contradictions(options: list[Setting], sets: list[Setting]) -> None:
    """Raise :class:`InputError` if ``--set`` and an option give different values to one field."""
    for option in options:
        for setting in sets:
            if setting.path == option.path and setting.value != option.value:
                stated = f"{setting.place}={value_excerpt(setting.value)}"
                raise InputError(f"{stated} contradicts {option.place} {option.value}: give one of them")


def _user_fields(old: object) -> dict[str, Any]:
    """Other fields of a quantity whose value or scatter the user sets."""
    if not isinstance(old, dict):
        return {"source": "user"} if old is None else {"value": old, "source": "user"}
    if old.get("source") == "user":
        return {}
    ref = f"given by the user; the fabric file has {old.get('value')} ({old.get('source')})"
    return {"source": "user", "ref": ref, "tuned_on": [], "chosen_by": []}


#: parts of a quantity with which no run computes
SOURCE_FIELDS = ("source", "ref", "tuned_on", "chosen_by")


def leaf_values(value: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Path and value of each number or text below ``value``; the number of a quantity has the path of the quantity."""
    for name, inner in value.items():
        if name in SOURCE_FIELDS:
            continue
        if isinstance(inner, Mapping):
            yield from leaf_values(inner, f"{prefix}{name}.")
        else:
            yield (prefix.removesuffix(".") if name == "value" else f"{prefix}{name}"), inner
