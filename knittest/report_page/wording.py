"""Text that a page can hold: long words may break, and no character is one that HTML forbids."""

import re

_JOINTS = re.compile(r"(?<=[._/])(?=[A-Za-z])")
_HASH = re.compile(r"\w{30,}(-dirty)?")
_STEP = 16
_LAST_OF_PLANES = "".join(chr(plane * 0x10000 + last) for plane in range(1, 17) for last in (0xFFFE, 0xFFFF))
#: control characters, halves of surrogate pairs and code points that are no characters
_FORBIDDEN = re.compile(f"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff{_LAST_OF_PLANES}]")
#: characters of a label in a picture
_LABEL = 70


def parts(text: str) -> list[str]:
    """``text`` cut where a line may end, so that tables fit a phone; a template puts ``<wbr>`` between."""
    found = []
    for word in _JOINTS.split(text):
        found += [word[i : i + _STEP] for i in range(0, len(word), _STEP)] if _HASH.fullmatch(word) else [word]
    return found


def without_forbidden(text: str) -> str:
    """``text`` with U+FFFD for what HTML forbids, which a damaged file may hold."""
    return _FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", text)


def label(text: str) -> str:
    """``text`` as one line of a legend, where a dollar sign is one and begins no formula."""
    plain = "".join(c if c.isprintable() else " " for c in text)
    return (plain if len(plain) <= _LABEL else plain[: _LABEL - 3] + "...").replace("$", r"\$")
