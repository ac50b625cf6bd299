"""Texts that users read: no word of the list of the guide that a reader from outside does not know."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: private words, and what to write instead
PRIVATE = {
    r"yarns at rest|state of rest": "relaxed fabric, initial equilibrium",
    r"out of balance": "residual contact-force imbalance",
    r"\bjudged by\b|\bgates? (judged|refused)\b|quality gates?": "quality checks, evaluated",
    r"\bgo(es)? on with\b": "resume, continue",
    r"running beside": "running in parallel",
    r"\bdrawn in by\b|draw-in of (the )?loops": "loop shortening",
    r"\bgripping\b": "spin-friction",
    r"\bbits are equal\b": "results are bitwise identical",
    r"\bheirs\b": "contact transfer",
}


def texts(path: Path) -> Iterator[tuple[int, str]]:
    """Line and text of every string of a module but docstrings and lone words."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    docs = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        and node.body
        and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in docs
            and " " in node.value
        ):
            yield node.lineno, node.value


def pages() -> list[Path]:
    return [*ROOT.glob("docs/*.md"), *ROOT.glob("docs/theory/*.md"), ROOT / "README.md"]


@pytest.mark.parametrize("pattern", PRIVATE, ids=list(PRIVATE.values()))
def test_no_text_uses_a_private_word(pattern: str) -> None:
    said = re.compile(pattern, re.IGNORECASE)
    found = [
        f"{path.relative_to(ROOT)}:{line}: {text[:80]}"
        for path in (ROOT / "knittest").rglob("*.py")
        for line, text in texts(path)
        if said.search(text)
    ]
    found += [
        f"{path.relative_to(ROOT)}:{number}: {line[:80]}"
        for path in pages()
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if said.search(line)
    ]
    assert found == []


def test_the_words_are_found_where_they_stand(tmp_path: Path) -> None:
    (tmp_path / "m.py").write_text('"""yarns at rest"""\nA = "yarns at rest, warp"\n')
    assert list(texts(tmp_path / "m.py")) == [(2, "yarns at rest, warp")]
    assert all(not re.search(pattern, better) for pattern, better in PRIVATE.items())
