"""Fabrics and settings of the Python interface."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Self

from knittest.base.errors import InputError
from knittest.base.kinds import DEFAULT
from knittest.config.fabric import Fabric as Fields
from knittest.config.fields import field_at
from knittest.config.messages import unknown_name_text
from knittest.config.settings import Setting
from knittest.config.sources import variant_path
from knittest.config.yaml_loader import KeyPath

#: settings by dotted path, nested or not, or texts ``key.path=value``
Sets = Mapping[str, Any] | Sequence[str]


def settings_of(sets: Sets, kind: str) -> tuple[Setting | str, ...]:
    """Settings of a run of ``kind`` from ``sets``; raises :class:`InputError` for anything else."""
    if isinstance(sets, Mapping):
        return tuple(nested_settings(sets, (), kind, "--set"))
    if isinstance(sets, str):
        return (sets,)
    if isinstance(sets, Sequence) and all(isinstance(one, str) for one in sets):
        return tuple(sets)
    raise InputError(f'set = {sets!r}: expected a dict such as {{"rig.width": 50}}')


def nested_settings(sets: Mapping[str, Any], above: KeyPath, kind: str, said: str) -> Iterator[Setting]:
    """One setting per value of ``sets``, whose keys are paths below ``above``; a quantity is one value."""
    for key, value in sets.items():
        if not isinstance(key, str) or not all(key.split(".")):
            raise InputError(f'set: {key!r}: expected the path of a field, such as "rig.width"')
        path: KeyPath = (*above, *key.split("."))
        field = field_at(path, kind)
        if isinstance(value, Mapping) and not (field and field.is_quantity):
            yield from nested_settings(value, path, kind, said)
        else:
            yield Setting(path, to_yaml_value(value), f"{said} {'.'.join(map(str, path))}")


def to_yaml_value(value: Any) -> Any:
    """Convert a value to that of YAML: a path to text, NumPy numbers and arrays to Python's, a tuple to a list."""
    if isinstance(value, PathLike):
        return fspath(value)
    if isinstance(value, Mapping):
        return {key: to_yaml_value(one) for key, one in value.items()}
    if hasattr(value, "tolist"):
        return value.tolist()
    return [to_yaml_value(one) for one in value] if isinstance(value, list | tuple) else value


FILES = (".yaml", ".yml")


@dataclass(frozen=True)
class Fabric:
    """Immutable fabric: a shipped ``variant`` or a ``file``, with ``settings``; made by :meth:`load`, :meth:`with_`."""

    variant: str | None = None
    file: Path | None = None
    settings: tuple[Setting, ...] = ()

    @classmethod
    def load(cls, fabric: "FabricLike") -> Self:
        """Load the shipped fabric "1", "2" or a name, or a file (.yaml); raises :class:`InputError` without one."""
        if isinstance(fabric, Fabric):
            return cls(fabric.variant, fabric.file, fabric.settings)
        if isinstance(fabric, bool) or not isinstance(fabric, str | int | PathLike):
            raise InputError(f'fabric = {fabric!r}: expected "1", "2", a name, the path of a fabric file, or a Fabric')
        if isinstance(fabric, PathLike) or str(fabric).endswith(FILES):
            file = Path(fabric)  # type: ignore[arg-type]  # no number ends with .yaml
            if not file.is_file():
                raise InputError(f"{file}: no such fabric file")
            return cls(file=file)
        variant_path(str(fabric))
        return cls(variant=str(fabric))

    def with_(self, **fields: Any) -> Self:
        """Return the fabric with other ``fields``, in the units of the fabric file: ``loop_length=14.2`` [mm].

        Fields inside others are dicts: ``contact={"friction_coefficient": 0.2}`` [-]. The source of the numbers becomes
        the user. Raises :class:`InputError` for an unknown field.
        """
        for name in fields:
            if name not in Fields.model_fields:
                raise InputError(f"with_({name}=...): {unknown_name_text(name, list(Fields.model_fields))}")
        added = tuple(nested_settings(fields, ("fabric",), DEFAULT, "with_"))
        return replace(self, settings=(*self.settings, *added))


FabricLike = str | int | PathLike[str] | Fabric
