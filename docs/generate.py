"""Writes the pages of docs that are made of the models, the commands and stored runs. In a checkout:

python -m docs.generate           writes reference-config.md, reference-cli.md, validation.md, structures.md,
                                  acrylic-knits.md and stub
python -m docs.generate --check   writes nothing, exits with 1 when one of them is not what it would write
"""

import sys
from pathlib import Path
from typing import Any

import click

from docs.generate_config import config_reference, plain, table
from docs.generate_knits import knits_page
from docs.generate_structures import structures_page
from docs.generate_stub import stub
from docs.generate_validation import validation_page
from knittest.cli.main import cli, summaries

HERE = Path(__file__).parent
STUB = "../knittest/__init__.pyi"
NOTE = "<!-- written by python -m docs.generate: do not edit -->"
OPTION_HEADER = ("option", "value", "default", "what")
CLI_INTRO = """
# Commands

This page lists all commands and options, as `knittest COMMAND --help` (or `-h`) prints them. Exit codes are in
[reliability.md](reliability.md). `knittest --version` prints the version.
""".strip()


def main() -> int:
    """Write all of them, or with ``--check`` compare them; returns the exit code."""
    stale = []
    for name, text in references().items():
        path = HERE / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            stale.append(name)
            if "--check" not in sys.argv[1:]:
                path.write_text(text, encoding="utf-8")
    print("\n".join(f"docs/{name}: not up to date" for name in stale) or "up to date")
    return 1 if stale and "--check" in sys.argv[1:] else 0


def references() -> dict[str, str]:
    """Text of each file by its name in docs."""
    texts = {"reference-config.md": config_reference(), "reference-cli.md": cli_reference()}
    texts |= {"validation.md": validation_page(), "structures.md": structures_page(), "acrylic-knits.md": knits_page()}
    return {name: f"{NOTE}\n\n{text}" for name, text in texts.items()} | {STUB: stub()}


def cli_reference() -> str:
    """Markdown of every command with its arguments and options."""
    parts = [CLI_INTRO]
    for name in summaries():
        command = cli.get_command(click.Context(cli), name)
        parts += _command(f"knittest {name}", command)
    return "\n\n".join(parts) + "\n"


def _command(name: str, command: Any) -> list[str]:
    """Heading, help, usage and options of a command, then of those below it."""
    context = click.Context(command, info_name=name)
    level = "#" * len(name.split())
    text = "\n\n".join(_prose(part) for part in (command.help or "").split("\n\n"))
    if isinstance(command, click.Group):
        below = [command.get_command(context, inner) for inner in command.list_commands(context)]
        return [f"{level} {name}", text, *(p for one in below for p in _command(f"{name} {one.name}", one))]
    arguments = [p for p in command.params if isinstance(p, click.Argument)]
    options = [p for p in command.params if isinstance(p, click.Option)]
    usage = " ".join([name, *(["[OPTIONS]"] if options else []), *map(_argument, arguments)])
    rows = [_option(option) for option in options]
    return [f"{level} {name}", text, f"```\n{usage}\n```", *([table(OPTION_HEADER, rows)] if rows else [])]


def _prose(paragraph: str) -> str:
    """A paragraph of help; an example as code."""
    words = " ".join(paragraph.split())
    return f"Example: `{words.removeprefix('Example: ')}`" if words.startswith("Example: ") else plain(words)


def _argument(argument: click.Argument) -> str:
    name = argument.metavar or _choices(argument) or (argument.name or "").upper()
    many = "..." if argument.nargs == -1 and not name.endswith("...") else ""
    return f"{name}{many}" if argument.required else f"[{name}{many}]"


def _option(option: click.Option) -> tuple[str, ...]:
    names = ", ".join(f"`{name}`" for name in option.opts)
    value = "" if option.is_flag else _value(option)
    required = "required" if option.required else ""
    default = str(option.default) if option.show_default else ""
    return names, value, required or default, _said(option)


def _said(option: click.Option) -> str:
    text = " ".join((option.help or "").split())
    return plain(f"{text} Repeatable." if option.multiple and "repeatable" not in text else text)


def _value(option: click.Option) -> str:
    """Values that an option takes: its choices, or a word for it and the range of a number."""
    if isinstance(option.type, click.Choice):
        return " or ".join(f"`{choice}`" for choice in option.type.choices)
    word = option.metavar or option.type.name.upper().removesuffix(" RANGE")
    return f"`{word}`{_range(option.type)}"


def _range(kind: Any) -> str:
    if not isinstance(kind, click.IntRange | click.FloatRange):
        return ""
    low = [] if kind.min is None else [f"{'>' if kind.min_open else '≥'} {kind.min:g}"]
    high = [] if kind.max is None else [f"{'<' if kind.max_open else '≤'} {kind.max:g}"]
    return f" {', '.join(low + high)}"


def _choices(parameter: click.Parameter) -> str:
    return "{" + ",".join(map(str, parameter.type.choices)) + "}" if isinstance(parameter.type, click.Choice) else ""


if __name__ == "__main__":
    sys.exit(main())
