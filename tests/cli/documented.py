"""Every command that the pages show, found in their blocks and inline code, and what a test does with each."""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = (ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md")))
#: run line by line, in its order, by test_tutorial.py
TUTORIAL = ROOT / "docs/own-fabric.md"
#: its commands are those of stored runs, which test_validation_page.py resolves one by one
STORED = ROOT / "docs/validation.md"
#: usage lines of the reference: a command and the names of its arguments
USAGE = ROOT / "docs/reference-cli.md"


@dataclass(frozen=True)
class Shown:
    """A command as a page shows it, and where."""

    text: str
    page: str
    inline: bool


@dataclass(frozen=True)
class Do:
    """Run it, with words that the page leaves open replaced and ``less`` appended to make it small; ``planned`` is why
    it is too long even so: then all is read, resolved and planned, and the first run is where it ends.
    """

    less: str = ""
    given: dict[str, str] = field(default_factory=dict)
    planned: str = ""

    def words(self, text: str) -> list[str]:
        """Command that is run instead of ``text``."""
        for word, value in self.given.items():
            assert word in text, f"{word} is not in: {text}"
            text = text.replace(word, value)
        return [*shlex.split(text), *shlex.split(self.less)]


def shown() -> list[Shown]:
    """All commands of all pages but the tutorial's."""
    found: dict[str, Shown] = {}
    for page in PAGES:
        if page not in (TUTORIAL, STORED):
            for one in _of_page(page):
                found.setdefault(one.text, one)
    return list(found.values())


def _of_page(page: Path) -> Iterator[Shown]:
    text = page.read_text(encoding="utf-8")
    for language, block in re.findall(r"^ *```(\w*)\n(.*?)^ *```$", text, re.M | re.S):
        if language in ("", "sh") and page != USAGE:
            yield from (Shown(line, page.name, False) for line in _lines(block))
    for code in re.findall(r"`(knittest [^`\n]+)`", re.sub(r"^ *```.*?^ *```$", "", text, flags=re.M | re.S)):
        yield from (Shown(part, page.name, True) for part in code.split(" && "))


def _lines(block: str) -> Iterator[str]:
    """Commands of a block: lines joined at a backslash, without comments, parted at &&; none of a file's content."""
    joined = re.sub(r"\\\n\s*", "", block)
    for line in joined.splitlines():
        command = re.sub(r"\s+#.*", "", line).strip()
        if re.match(r"(knittest|python3?|cp|dask|\.venv/bin/\S+) ", command):
            yield from command.replace(".venv/bin/knittest", "knittest").split(" && ")
