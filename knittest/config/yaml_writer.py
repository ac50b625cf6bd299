"""Writer of runs as YAML with units, which the loader reads back to an equal run."""

from typing import Any

import yaml

from knittest import __version__
from knittest.base.kinds import DEFAULT
from knittest.config.fields import field_at
from knittest.config.run import Run
from knittest.config.yaml_loader import CORE_SCHEMA, KeyPath, parse_document

LINE_WIDTH = 10_000  # no folding: a value stays in the line of its key
#: loader of the C library where PyYAML has it: six times faster, which counts in sweeps of short runs
LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _CoreDumper(yaml.SafeDumper):
    """Dumper that quotes texts which YAML 1.2, not 1.1, would read as another type."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 - PyYAML's own class-level registry

    def ignore_aliases(self, data: object) -> bool:
        """Write equal values out, without aliases."""
        return True


for _tag, (_pattern, _first) in CORE_SCHEMA.items():
    _CoreDumper.add_implicit_resolver(_tag, _pattern, [*_first] + ([""] if _pattern.match("") else []))


def dump(run: Run) -> str:
    """YAML of the fully resolved ``run``; ``knittest TEST --config`` with it repeats the run."""
    head = f"# One virtual test, fully resolved by knittest {__version__}. Repeat it with --config THIS_FILE.\n"
    return head + dump_mapping(run.model_dump(mode="json"))


def dump_mapping(data: dict[str, Any], at: KeyPath = ()) -> str:
    """YAML of settings below ``at`` of a run, each field with its unit as a comment."""
    text = yaml.dump(data, Dumper=_CoreDumper, sort_keys=False, allow_unicode=True, width=LINE_WIDTH)
    lines = text.splitlines()
    kind = data.get("rig", {}).get("kind", DEFAULT) if not at else DEFAULT
    for path, line in parse_document(text, "dump", LOADER).lines.items():
        field = field_at(at + path, kind)
        if field and field.unit and path[-1] not in ("value", "sd", "warp", "weft"):
            lines[line - 1] += f"  # {field.unit if field.unit != '1' else 'dimensionless'}"
    return "\n".join(lines) + "\n"


def flow_text(value: object) -> str:
    """YAML of ``value`` on one line."""
    text = yaml.dump(
        value, Dumper=_CoreDumper, sort_keys=False, allow_unicode=True, default_flow_style=True, width=LINE_WIDTH
    )
    return str(text).removesuffix("...\n").strip()
