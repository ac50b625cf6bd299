"""The site holds every page of docs, needs no network, and its theory names files that are there."""

import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
SITE = yaml.safe_load((ROOT / "mkdocs.yml").read_text(encoding="utf-8"))


def pages(nav: Any) -> list[str]:
    """Files of a navigation, in their order."""
    if isinstance(nav, str):
        return [nav]
    return [page for part in (nav.values() if isinstance(nav, dict) else nav) for page in pages(part)]


def test_every_page_has_its_place():
    there = {str(path.relative_to(DOCS)) for path in DOCS.rglob("*.md")}
    named = pages(SITE["nav"])
    assert sorted(named) == sorted(there) and len(named) > 40


def test_pages_open_without_network_or_server():
    assert SITE["theme"]["font"] is False and SITE["use_directory_urls"] is False
    assert not SITE.get("extra_javascript")


def test_a_broken_link_stops_the_build():
    assert set(SITE["validation"]["links"].values()) == set(SITE["validation"]["nav"].values()) == {"warn"}
    ci = (ROOT / ".ci/run").read_text(encoding="utf-8")
    assert 'mkdocs" build --strict' in ci and "docs]'" in ci
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert all(any(need.startswith(name) for need in extras["docs"]) for name in ("mkdocs-material", "mkdocstrings"))


@pytest.mark.parametrize("page", sorted((DOCS / "theory").glob("*.md")), ids=lambda path: path.stem)
def test_theory_names_files_that_are_there(page):
    """And states equations, with where they come from."""
    text = page.read_text(encoding="utf-8")
    named = re.findall(r"`((?:kernels|models|materials|solve)/\w+\.py)`", text)
    assert [name for name in named if not (ROOT / "knittest" / name).is_file()] == [] and named
    assert text.count("$$") % 2 == 0 and (page.stem == "index" or text.count("$$") >= 4)


def test_what_python_documents_is_there():
    from importlib import import_module

    for name in re.findall(r"^::: (\S+)$", (DOCS / "reference-python.md").read_text(encoding="utf-8"), re.M):
        module, _, last = name.rpartition(".")
        assert hasattr(import_module(module), last) or import_module(name), name


def test_readme_counts_what_the_validation_counts():
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    summary = (DOCS / "validation.md").read_text(encoding="utf-8")
    (predicted, tuned, given) = (
        re.search(rf"`{kind}`: (\d+ of \d+) rows pass", summary)[1] for kind in ("predicted", "tuned", "input")
    )
    assert f"{predicted} predicted results, {tuned} tuned ones and {given} inputs pass" in readme


def test_the_version_is_the_same_everywhere():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    (released,) = re.findall(rf"^## {re.escape(version)} \((.*)\)$", (ROOT / "CHANGELOG.md").read_text(), re.M)
    assert citation["version"] == version and str(citation["date-released"]) == released
    from knittest import __version__

    assert __version__ == version
