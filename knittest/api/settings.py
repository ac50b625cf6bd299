"""Values of a caller in Python, as settings of a run."""

from collections.abc import Iterator, Mapping, Sequence
from os import PathLike, fspath
from typing import Any

from knittest.base.errors import InputError
from knittest.config.fields import place
from knittest.config.settings import Setting
from knittest.config.yaml_loader import KeyPath

#: settings by dotted path, nested or not, or texts ``key.path=value``
Sets = Mapping[str, Any] | Sequence[str]


def settings_of(sets: Sets, kind: str) -> tuple[Setting | str, ...]:
    """Settings of a run of ``kind`` that ``sets`` state; raises :class:`InputError` for what states none."""
    if isinstance(sets, Mapping):
        return tuple(nested(sets, (), kind, "--set"))
    if isinstance(sets, str):
        return (sets,)
    if isinstance(sets, Sequence) and all(isinstance(one, str) for one in sets):
        return tuple(sets)
    raise InputError(f'set = {sets!r}: expected a dict such as {{"rig.width": 50}}')


def nested(sets: Mapping[str, Any], above: KeyPath, kind: str, said: str) -> Iterator[Setting]:
    """One setting a value of ``sets``, whose keys are paths below ``above``; a quantity is one value."""
    for key, value in sets.items():
        if not isinstance(key, str) or not all(key.split(".")):
            raise InputError(f'set: {key!r}: expected a path of a field, for example "rig.width"')
        path: KeyPath = (*above, *key.split("."))
        field = place(path, kind)
        if isinstance(value, Mapping) and not (field and field.is_quantity):
            yield from nested(value, path, kind, said)
        else:
            yield Setting(path, plain(value), f"{said} {'.'.join(map(str, path))}")


def plain(value: Any) -> Any:
    """The value as YAML would have it: a path as text, a NumPy number or array as Python's, a tuple as a list."""
    if isinstance(value, PathLike):
        return fspath(value)
    if isinstance(value, Mapping):
        return {key: plain(one) for key, one in value.items()}
    if hasattr(value, "tolist"):
        return value.tolist()
    return [plain(one) for one in value] if isinstance(value, list | tuple) else value
