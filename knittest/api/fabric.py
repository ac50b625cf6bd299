"""Fabrics and settings as a caller in Python names them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike, fspath
from pathlib import Path
from typing import Any, Self

from knittest.base.errors import InputError
from knittest.base.kinds import DEFAULT
from knittest.config.fabric import Fabric as Fields
from knittest.config.fields import place
from knittest.config.messages import unknown
from knittest.config.settings import Setting
from knittest.config.sources import variant_path
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


FILES = (".yaml", ".yml")


@dataclass(frozen=True)
class Fabric:
    """A fabric: ``variant``, a shipped one, or ``file``, and the settings that go over it.

    Make it by :meth:`load`; it does not change, :meth:`with_` makes another.
    """

    variant: str | None = None
    file: Path | None = None
    settings: tuple[Setting, ...] = ()

    @classmethod
    def load(cls, fabric: "FabricLike") -> Self:
        """Take the shipped fabric "1", "2" or a name, or the file whose path ends with .yaml.

        Raises :class:`InputError` where there is none.
        """
        if isinstance(fabric, Fabric):
            return cls(fabric.variant, fabric.file, fabric.settings)
        if isinstance(fabric, bool) or not isinstance(fabric, str | int | PathLike):
            raise InputError(f'fabric = {fabric!r}: expected "1", "2", a name, the path of a fabric file, or a Fabric')
        if isinstance(fabric, PathLike) or str(fabric).endswith(FILES):
            file = Path(fabric)  # type: ignore[arg-type]  # no number ends with .yaml
            if not file.is_file():
                raise InputError(f"{file}: there is no such fabric file")
            return cls(file=file)
        variant_path(str(fabric))
        return cls(variant=str(fabric))

    def with_(self, **fields: Any) -> Self:
        """Return the same fabric with other ``fields``, in the units of the fabric file: ``loop_length=14.2`` [mm].

        Fields inside others are dicts: ``contact={"friction_coefficient": 0.2}`` [-]. The numbers are the user's own:
        what the file says of their source no longer counts. Raises :class:`InputError` for a field there is not.
        """
        for name in fields:
            if name not in Fields.model_fields:
                raise InputError(f"with_({name}=...): {unknown(name, list(Fields.model_fields))}")
        added = tuple(nested(fields, ("fabric",), DEFAULT, "with_"))
        return replace(self, settings=(*self.settings, *added))


FabricLike = str | int | PathLike[str] | Fabric
