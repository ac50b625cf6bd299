"""Plain YAML scalars by the core schema of YAML 1.2 (chapter 10.3), as the loader reads and the dumper writes them."""

import re

#: tag -> pattern of a plain scalar and the characters it can start with
CORE_SCHEMA: dict[str, tuple[re.Pattern[str], str]] = {
    "tag:yaml.org,2002:null": (re.compile(r"(?:null|Null|NULL|~|)$"), "nN~"),
    "tag:yaml.org,2002:bool": (re.compile(r"(?:true|True|TRUE|false|False|FALSE)$"), "tTfF"),
    "tag:yaml.org,2002:int": (re.compile(r"(?:[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+)$"), "-+0123456789"),
    "tag:yaml.org,2002:float": (
        re.compile(r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?$"),
        "-+.0123456789",
    ),
}
NON_FINITE = re.compile(r"(?:[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))$")
INTEGER_DIGITS = 18  # fits 64 bits

Scalar = str | int | float | bool | None


def read_plain(text: str) -> Scalar:
    """Value of a plain scalar; raise ``ValueError`` for what is no usable number (infinite, nan, huge)."""
    if NON_FINITE.match(text):
        raise ValueError("expected a finite number")
    for tag, (pattern, _) in CORE_SCHEMA.items():
        if pattern.match(text):
            return _READ[tag](text)
    return text


def _integer(text: str) -> int:
    if len(text.lstrip("+-")) > INTEGER_DIGITS:
        raise ValueError(f"expected an integer of at most {INTEGER_DIGITS} digits")
    base = {"0o": 8, "0x": 16}.get(text[:2], 10)
    return int(text, base)


def _float(text: str) -> float:
    number = float(text)
    if number in (float("inf"), float("-inf")):
        raise ValueError("expected a number below 1.8e308")
    return number


_READ = {
    "tag:yaml.org,2002:null": lambda text: None,
    "tag:yaml.org,2002:bool": lambda text: text.lower() == "true",
    "tag:yaml.org,2002:int": _integer,
    "tag:yaml.org,2002:float": _float,
}
