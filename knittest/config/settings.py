"""Single settings from the command line: options and ``--set key.path=value``."""

from dataclasses import dataclass
from typing import Any

from knittest.base.errors import InputError
from knittest.config.fields import place
from knittest.config.layers import Layers
from knittest.config.yaml_loader import KeyPath, parse_value, shown


@dataclass(frozen=True)
class Setting:
    """One value at ``path`` of the run; ``said`` is how the user gave it."""

    path: KeyPath
    value: Any
    said: str


def parse_set(text: str) -> Setting:
    """Read one ``key.path=value``; the value is YAML. Raises :class:`InputError`."""
    name, equals, value = text.partition("=")
    path: KeyPath = tuple(part.strip() for part in name.split("."))
    if not equals or not all(path):
        raise InputError(f"--set {shown(text)}: expected key.path=value, for example rig.width=50")
    said = f"--set {name.strip()}"
    return Setting(path, parse_value(value, said), said)


def lay_setting(layers: Layers, setting: Setting) -> None:
    """Lay one setting over ``layers``; a number of the fabric given so is the user's, its stated scatter stays.

    A null in place of a number takes the whole quantity away, as if it had not been given.
    """
    path, value = setting.path, setting.value
    kind = layers.get(("rig", "kind"))
    field = place(path, kind)
    if field and field.is_quantity and not isinstance(value, dict):
        path = (*path, "value")
    holder = place(path[:-1], kind)
    if holder and holder.is_quantity and path[-1] == "value" and value is None:
        path = path[:-1]
    elif holder and holder.is_quantity and path[-1] in ("value", "sd"):
        layers.lay(_users_own(layers.get(path[:-1])), lambda _: setting.said, path[:-1])
    layers.lay(value, lambda _: setting.said, path)


def refuse_contradictions(options: list[Setting], sets: list[Setting]) -> None:
    """Raise :class:`InputError` when ``--set`` and an option say different things about one field."""
    for option in options:
        for setting in sets:
            if setting.path == option.path and setting.value != option.value:
                stated = f"{setting.said}={shown(setting.value)}"
                raise InputError(f"{stated} contradicts {option.said} {option.value}: give one of them")


def _users_own(old: object) -> dict[str, Any]:
    """Changes to a quantity's other fields when the user sets its value or scatter."""
    if not isinstance(old, dict):
        return {"source": "user"} if old is None else {"value": old, "source": "user"}
    if old.get("source") == "user":
        return {}
    ref = f"given by the user; the fabric's own is {old.get('value')} ({old.get('source')})"
    return {"source": "user", "ref": ref, "tuned_on": [], "chosen_by": []}
