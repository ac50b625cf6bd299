"""A fabric as a caller in Python names it: shipped, in a file, or one of these with other numbers."""

from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Any, Self

from knittest.api.settings import nested
from knittest.base.errors import InputError
from knittest.base.kinds import DEFAULT
from knittest.config.fabric import Fabric as Fields
from knittest.config.messages import unknown
from knittest.config.settings import Setting
from knittest.config.sources import variant_path

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
