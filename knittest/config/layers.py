"""Settings laid over each other, each remembering the file line or option it came from."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from knittest.config.yaml_loader import KeyPath

Where = Callable[[KeyPath], str]


@dataclass
class Layers:
    """Merged ``data`` and the ``origin`` (``file:line`` or option) of every key path in it."""

    data: dict[str, Any] = field(default_factory=dict)
    origin: dict[KeyPath, str] = field(default_factory=dict)

    def lay(self, value: object, where: Where, at: KeyPath = ()) -> None:
        """Lay ``value`` over what is at ``at``: mappings merge, all else replaces; ``where`` tells a path's origin."""
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

    def where(self, path: KeyPath) -> str | None:
        """Origin of ``path`` or of its nearest ancestor; ``None`` for a default."""
        while path and path not in self.origin:
            path = path[:-1]
        return self.origin.get(path)

    def _replace(self, value: object, where: Where, at: KeyPath) -> None:
        for path in [p for p in self.origin if p[: len(at)] == at]:
            del self.origin[path]
        holder: Any = self.data
        for depth, part in enumerate(at[:-1], 1):
            if not isinstance(holder.get(part), dict):
                holder[part] = {}
                self.origin[at[:depth]] = where(at)
            holder = holder[part]
        holder[at[-1]] = _copied(value)
        self._note(value, where, at)

    def _note(self, value: object, where: Where, at: KeyPath) -> None:
        self.origin[at] = where(at)
        inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
        for key, item in inner:
            self._note(item, where, (*at, key))


def _is_quantity(value: dict[str, Any]) -> bool:
    """A stated quantity replaces another as a whole: its scatter and source must not outlive its value."""
    return "value" in value


def _copied(value: object) -> Any:
    if isinstance(value, dict):
        return {key: _copied(item) for key, item in value.items()}
    return [_copied(item) for item in value] if isinstance(value, list) else value
