"""The reference pages are what docs/generate.py gives, and leave nothing out."""

import importlib
import sys
from pathlib import Path

import click
import pytest

from knittest.cli.main import cli, summaries
from knittest.config.fields import all_paths, field_at
from knittest.config.run import RUNS

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def generate():
    sys.path.append(str(DOCS.parent))
    try:
        return importlib.import_module("docs.generate")
    finally:
        sys.path.remove(str(DOCS.parent))


PAGES = ["reference-config.md", "reference-cli.md", "validation.md", "../knittest/__init__.pyi"]


@pytest.mark.parametrize("name", PAGES)
def test_page_is_up_to_date(generate, name):
    written = (DOCS / name).read_text(encoding="utf-8")
    assert written == generate.references()[name], f"docs/{name} is not up to date: run python -m docs.generate"


@pytest.mark.parametrize("kind", RUNS)
def test_every_field_is_there_with_its_unit(generate, kind):
    rows = {line.split(" | ")[0].strip("| `"): line for line in generate.config_reference().splitlines()}
    found = [(path, field_at(tuple(path.split(".")), kind)) for path in all_paths(kind)]
    fields = [(path, at) for path, at in found if at.model is None or at.is_quantity]
    assert len(fields) > 60
    for path, at in fields:
        assert path in rows, path
        assert at.unit in ("", "1") or f"| {at.unit} |" in rows[path], path


def test_every_option_of_every_command_is_there_with_its_help(generate):
    text = generate.cli_reference()
    commands = [(f"knittest {name}", cli.get_command(click.Context(cli), name)) for name in summaries()]
    for name, command in commands:
        if isinstance(command, click.Group):
            commands += [(f"{name} {below}", one) for below, one in command.commands.items()]
            continue
        (part,) = [p for p in text.split("\n\n#") if f"# {name}\n" in f"#{p}\n"]
        options = [p for p in command.params if isinstance(p, click.Option)]
        assert all(f"| `{option.opts[0]}`" in part for option in options), name
        assert part.count("\n| `-") == len(options)
        assert " ".join((command.help or "").split("Example: ")[-1].split()) in part


def test_check_finds_what_is_stale_and_writes_nothing(generate, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(generate, "HERE", tmp_path)
    monkeypatch.setattr(sys, "argv", ["generate.py", "--check"])
    monkeypatch.setattr(generate, "STUB", "stub.pyi")
    assert generate.main() == 1 and not list(tmp_path.iterdir())
    assert "docs/reference-cli.md: not up to date" in capsys.readouterr().out
    monkeypatch.setattr(sys, "argv", ["generate.py"])
    assert generate.main() == 0 and len(list(tmp_path.iterdir())) == 6
    monkeypatch.setattr(sys, "argv", ["generate.py", "--check"])
    assert generate.main() == 0
    (tmp_path / "reference-cli.md").write_text("old")
    assert generate.main() == 1
