"""Docstrings begin with a noun or a verb, and say plainly what they mean."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: first words that are neither: a sentence that begins with one makes the reader wait for what it is about
NEITHER = {
    "how", "that", "there", "these", "those", "this", "what", "when", "where", "whether", "which", "who", "why",
}  # fmt: skip
#: the same in the package, where a docstring names the thing; in a test it may state under which conditions it holds
NOT_A_THING = NEITHER | {"as", "at", "everything", "from", "if", "in", "it", "its", "nothing", "of", "with", "within",
                         "without"}  # fmt: skip
#: words that a native engineer would not write, and the plain ones
UNPLAIN = {
    r"\bso many\b": "the number of",
    r"\bdear (and|ones|runs)\b": "expensive",
    r"\bshall not count\b": "excluded",
}


def docstrings(source: str) -> Iterator[tuple[int, str]]:
    """Line and text of each docstring of a module."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text:
                yield node.body[0].lineno, text


def misbegun(source: str, banned: set[str]) -> list[str]:
    """Line and begin of each docstring that begins with a ``banned`` word."""
    return [
        f"{line}: {text[:60]}" for line, text in docstrings(source) if text.split()[0].strip(".,:;").lower() in banned
    ]


def files(folder: str) -> list[Path]:
    """Python files below ``folder`` of the checkout."""
    return sorted((ROOT / folder).rglob("*.py"))


@pytest.mark.parametrize(
    ("folder", "banned"),
    [("knittest", NOT_A_THING), ("tests", NEITHER), ("docs", NEITHER), ("benchmarks", NEITHER)],
)
def test_a_docstring_begins_with_a_noun_or_a_verb(folder: str, banned: set[str]) -> None:
    assert len(files(folder)) > 3
    found = {str(p.relative_to(ROOT)): misbegun(p.read_text(encoding="utf-8"), banned) for p in files(folder)}
    assert {path: lines for path, lines in found.items() if lines} == {}


def test_the_package_uses_plain_words() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{number}: {word!r}: write {plain!r}"
        for path in files("knittest")
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        for word, plain in UNPLAIN.items()
        if re.search(word, line)
    ]
    assert found == []


def test_the_check_sees_what_it_shall_see() -> None:
    source = '"""What a run keeps."""\ndef f():\n    """Whether it is so."""\nclass A:\n    """Force [N]."""\n'
    assert misbegun(source, NEITHER) == ["1: What a run keeps.", "3: Whether it is so."]
    assert misbegun('"""Of a yarn."""', NEITHER) == [] and misbegun('"""Of a yarn."""', NOT_A_THING) == [
        "1: Of a yarn."
    ]


def broken(text: str) -> bool:
    """Tell whether a line inside a paragraph of ``text`` is much shorter than the next word would have allowed."""
    lines = text.splitlines()
    return any(
        0 < len(line.strip()) <= 24 and before.strip() and after.strip() and not line.rstrip().endswith((".", ":", ";"))
        and len(before.rstrip()) > 80 and not re.match(r"\s*([-*>|]|\d+\.)", line)
        for before, line, after in zip(lines, lines[1:], lines[2:], strict=False)
    )  # fmt: skip


def test_no_docstring_is_broken_in_the_middle_of_a_paragraph() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for folder in ("knittest", "tests", "docs", "benchmarks")
        for path in files(folder)
        for line, text in docstrings(path.read_text(encoding="utf-8"))
        if broken(text)
    ]
    assert found == []
    assert broken("a" * 100 + "\nsticking\nspring") and not broken("a" * 100 + "\nspring.")
