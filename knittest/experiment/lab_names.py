"""Names that machine files give to things, in eight languages: the table ``lab_names.yaml``, compiled."""

import re
import unicodedata
from functools import lru_cache
from typing import Any

from knittest.experiment import lab_units
from knittest.experiment.lab_units import table

#: sets of characters, which stay as they are, and letters with a mark
_MARKED = re.compile(r"\[[^\]]*\]|[à-öø-żÀ-ÖØ-Ż]")
#: last characters of a name, so that a long one takes no quadratic time
LONGEST = 200


@lru_cache(512)
def pattern(*path: str | int) -> re.Pattern[str]:
    """The pattern at ``path`` in the table: that of all languages together, or none that ever matches."""
    found: Any = table()
    for key in path:
        found = found.get(key, {}) if isinstance(found, dict) else found[key]
    if not found:
        return re.compile("(?!)")
    text = "|".join(found.values()) if isinstance(found, dict) else found
    return re.compile(_MARKED.sub(lambda letter: _with_and_without(letter[0]), text), re.I)


def _with_and_without(letter: str) -> str:
    """Pattern of a letter with its mark and without it, such as in 'Epaisseur', 'Pruefzeit' and 'Sila'."""
    plain = {"ł": "l", "ß": "ss"}.get(letter, unicodedata.normalize("NFD", letter)[0])
    if letter.startswith("[") or plain == letter:
        return letter
    return f"(?:{letter}|{plain}{'e?' if letter in 'äöü' else ''})"


def plainly(name: str) -> str:
    """``name`` with blanks for underscores, cut to a bounded length."""
    return name[:LONGEST].replace("_", " ")


@lru_cache(1)
def _statistics() -> re.Pattern[str]:
    return re.compile(rf"\W*({pattern('statistics').pattern})\W*([\s(\[%].*)?", re.I)


def is_statistic(cell: str) -> bool:
    """Tell whether ``cell`` labels a row of statistics, such as a mean."""
    return len(cell) < LONGEST and bool(_statistics().fullmatch(cell))


@lru_cache(4096)
def role(name: str, below: str = "") -> tuple[str, str]:
    """Role of the column ``name`` over the unit ``below``: the first that fits the name and does not contradict the
    unit; or none, and the role that the unit contradicts.
    """
    refused = ""
    for key, entry in table()["columns"].items():
        if pattern("columns", key, "any").search(plainly(name)):
            if not lab_units.is_of_another(name, below, tuple(entry.get("quantity", ()))):
                return key, ""
            refused = refused or key
    return "", refused


def is_kind(kind: str, name: str) -> bool:
    """Tell whether a column of travel or strain is one of the ``kind`` in the table, such as machine."""
    return bool(pattern("kinds", kind).search(plainly(name)))


def recognised(test: str, rows: list[list[str]]) -> bool:
    """Tell whether texts in ``rows`` at the head of a file say that it is of the own ``test``."""
    entry = table()["own_tests"].get(test, {})
    text, conditions = pattern("own_tests", test, "text"), entry.get("conditions", ())
    for row in rows:
        if any(text.search(plainly(cell)) or any(labels(key, cell) for key in conditions) for cell in row):
            return True
        roles = {role(cell)[0] for cell in row} if "roles" in entry else set()
        if any(roles.issuperset(some) for some in entry.get("roles", ())):
            return True
    return False


def labels(condition: str, cell: str, tier: int = 0) -> bool:
    """Tell whether ``cell`` names a ``condition`` by a label of rank ``tier``."""
    wanted, refused = pattern("conditions", condition, "tiers", tier), pattern("conditions", condition, "none")
    return bool(wanted.search(plainly(cell))) and not refused.search(plainly(cell))


def foreign(texts: list[str], own: tuple[str, ...]) -> tuple[str, str] | None:
    """Another kind of test than those of ``own`` that one of ``texts`` names, and the text."""
    for text in texts:
        plain = plainly(text)
        if pattern("no_test").search(plain):
            continue
        pulled = ("compression",) if pattern("pull").search(plain) else ()
        for kind in table()["tests"]:
            if kind not in (*own, *pulled) and pattern("tests", kind).search(plain):
                return kind, text
    return None


def count_known(text: str) -> int:
    """Letters beyond ASCII among the first lines of ``text`` that belong to names of columns and conditions."""
    lines = [line[:1000].replace("_", " ") for line in text[:20_000].splitlines()[:200] if not line.isascii()]
    known = [pattern("columns", key, "any") for key in table()["columns"]]
    for key, entry in table()["conditions"].items():
        known += [pattern("conditions", key, "tiers", tier) for tier in range(len(entry["tiers"]))]
    known += [pattern("statistics"), pattern("kinds", "symbol")]
    found = (match[0] for line in lines for words in known for match in words.finditer(line))
    return sum(not letter.isascii() for word in found for letter in word)
