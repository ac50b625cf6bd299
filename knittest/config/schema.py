"""The JSON schema of a run: fields with unit, bounds, plausibility band, default and description."""

from typing import Any

from knittest.base.kinds import DEFAULT
from knittest.config.run import RUNS

#: bounds as the models keep them -> their names in JSON schema (draft 2020-12); of a quantity they bind the bare number
KEYWORDS = {"gt": "exclusiveMinimum", "ge": "minimum", "le": "maximum"}


def run_schema(kind: str = DEFAULT) -> dict[str, Any]:
    """JSON schema of a run of ``kind``, for editors that complete and check YAML."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **_standard(RUNS[kind].model_json_schema())}


def _standard(node: object, names: bool = False) -> Any:
    """Rename the bounds; where ``names`` is true the keys of ``node`` are field names, not keywords."""
    if isinstance(node, list):
        return [_standard(item) for item in node]
    if not isinstance(node, dict):
        return node
    return {
        key if names else KEYWORDS.get(key, key): _standard(item, names=not names and key in ("properties", "$defs"))
        for key, item in node.items()
    }
