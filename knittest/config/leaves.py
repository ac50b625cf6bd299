"""Numbers and words of a config by dotted path, without what only says where they come from."""

from collections.abc import Iterator, Mapping

#: what no run computes with
TOLD = ("source", "ref", "tuned_on", "chosen_by")


def leaves(value: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Path and value of each number or word below ``value``; that of a quantity has the path of the quantity."""
    for name, inner in value.items():
        if name in TOLD:
            continue
        if isinstance(inner, Mapping):
            yield from leaves(inner, f"{prefix}{name}.")
        else:
            yield (prefix.removesuffix(".") if name == "value" else f"{prefix}{name}"), inner
