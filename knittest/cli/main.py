"""The ``knittest`` command: a table of subcommands, loaded when used, and the one place that ends a process."""

import errno
import importlib
import os
import signal
import sys
import tempfile
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import click

from knittest import __version__
from knittest.base.errors import OUT_OF_MEMORY, InputError, KnittestError, ResourceError, is_out_of_memory
from knittest.base.interrupts import INTERRUPTED, STOPPING, UntilSaved
from knittest.base.kinds import kinds

#: heading of ``--help`` for tests, which commands that begin one follow
TESTS = "Tests"
#: commands that are no test by the heading of ``--help``: name, module that holds it under the same name, what it does
HEADINGS = {
    TESTS: {
        "check": ("knittest.cli.testing", "Show size, time and consistency of a run before it starts."),
        "resume": ("knittest.cli.testing", "Continue a run that was stopped."),
    },
    "Fabrics and data": {
        "new": ("knittest.cli.system", "Write a commented fabric and rig to start from."),
        "fabric": ("knittest.cli.fabric", "Show, export or relax the yarn geometry."),
        "data": ("knittest.cli.data", "Import and summarise files of testing machines."),
        "schema": ("knittest.cli.system", "Explain a field, or print the JSON schema of a run."),
    },
    "Studies": {
        "batch": ("knittest.cli.studies", "Run a sweep over any fields, on this machine or a cluster."),
        "calibrate": ("knittest.cli.studies", "Fit parameters to measured results."),
        "uncertainty": ("knittest.cli.studies", "Bands and sensitivity indices from assumed ranges."),
        "homogenise": ("knittest.cli.studies", "Derive the material card of shells from tests of yarns."),
        "speed-study": ("knittest.cli.studies", "Repeat every test at half its speed."),
        "regress": ("knittest.cli.studies", "Compare Table 3 and a stored baseline, for CI."),
    },
    "Results": {
        "runs": ("knittest.cli.pages", "List run folders, or remove some."),
        "report": ("knittest.cli.pages", "Write one HTML page on runs, alone or compared."),
        "compare": ("knittest.cli.pages", "Compare a finished run with a curve of your own."),
        "view": ("knittest.cli.pages", "Write a page on which a run can be turned and played."),
        "animate": ("knittest.cli.pages", "Write a run as a film, MP4 or GIF."),
        "export": ("knittest.cli.export", "Write decks, workbooks, yarns and tools of a run."),
    },
    "Setup": {
        "doctor": ("knittest.cli.system", "Report versions, threads and cache."),
        "warmup": ("knittest.cli.system", "Compile all kernels now."),
        "bench": ("knittest.cli.system", "Measure the speed of the kernels."),
    },
}
#: the same by name
COMMANDS = {name: told for commands in HEADINGS.values() for name, told in commands.items()}
#: full disk, quota, read-only place, missing permission: the machine's trouble, not the program's
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES)
#: a path that no file can have
NO_PATH = (errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR)


class LazyGroup(click.Group):
    """Imports a command's module only when the command is used, so that ``--help`` is quick."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of the help."""
        return list(summaries())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command itself."""
        if cmd_name not in COMMANDS:
            return _test_command(cmd_name)
        command: click.Command = getattr(importlib.import_module(COMMANDS[cmd_name][0]), cmd_name.replace("-", "_"))
        return command

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; a reader who closed the pipe has seen enough (click would exit with 1)."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            return _print_nowhere()

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands by their headings, without importing them."""
        told = summaries()
        for heading, commands in HEADINGS.items():
            tests = [name for name in told if name not in COMMANDS] if heading == TESTS else []
            with formatter.section(heading):
                formatter.write_dl([(name, told[name]) for name in [*tests, *commands]], col_spacing=2)


def summaries() -> dict[str, str]:
    """Line of ``--help`` for each command, the tests first; raises :class:`InputError` for a test named like one."""
    tests = {name: kind.summary for name, kind in kinds().items()}
    if taken := sorted(tests.keys() & COMMANDS.keys()):
        raise InputError(f"test {taken[0]}: knittest {taken[0]} is a command of knittest: uninstall the test's package")
    return tests | {name: text for name, (_, text) in COMMANDS.items()}


def _test_command(name: str) -> click.Command | None:
    """The command of a test, if there is one of that name."""
    if name not in kinds():
        return None
    from knittest.cli.testing import test_command

    return test_command(kinds()[name])


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="knittest")
def cli() -> None:
    """Virtual material tests of biaxial weft-knitted fabrics.

    Example: knittest tensile --variant 2 --scale meso
    """


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with its code; no traceback reaches the user."""
    _open_what_is_closed()
    stops = UntilSaved()
    stops.install()
    sys.unraisablehook = _tell_but_of_signals
    for library in ("OPENBLAS", "MKL"):  # small systems: threads only wait for each other, long on a busy machine
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    try:
        code = run(arguments, stops)
        for number in STOPPING:  # all is done: until the interpreter has ended too, there is nothing to stop
            signal.signal(number, signal.SIG_IGN)
    except KeyboardInterrupt:  # once more, while the first one was being told
        code = INTERRUPTED
    if code == INTERRUPTED:
        _leave(code)
    sys.exit(code)


def _tell_but_of_signals(lost: "sys.UnraisableHookArgs") -> None:
    """Show what went wrong where nothing can be raised, but not a signal in a library's callback, which is noted."""
    if not isinstance(lost.exc_value, KeyboardInterrupt):
        sys.__unraisablehook__(lost)


def _open_what_is_closed() -> None:
    """Let no file of a run take the place of a stream that was closed before the start, and what is printed go nowhere.

    The lowest free descriptor is the one that is missing.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115 - to the end


def run(arguments: list[str] | None = None, stops: UntilSaved | None = None) -> int:
    """Run the command line; returns the exit code. What a library makes of a signal noted by ``stops`` counts as it."""
    try:
        result = cli.main(args=arguments, standalone_mode=False)
        sys.stdout.flush()
        return result if isinstance(result, int) else 0
    except click.exceptions.Abort as error:  # click's word for a KeyboardInterrupt
        return _say(str(error.__cause__ or "") or "interrupted", INTERRUPTED)
    except KeyboardInterrupt as error:
        return _say(str(error) or "interrupted", INTERRUPTED)
    except click.ClickException as error:
        with _even_if_nobody_reads():
            error.show()
        return 2
    except KnittestError as error:
        return _say(f"error: {error}", error.exit_code)
    except BrokenPipeError:
        return _print_nowhere()
    except Exception as error:
        if is_out_of_memory(error):
            return _say(f"error: {OUT_OF_MEMORY}", ResourceError.exit_code)
        if isinstance(error, OSError) and error.errno in NO_ROOM + NO_PATH:
            code = (InputError if error.errno in NO_PATH else ResourceError).exit_code
            if error.filename is None:
                _print_nowhere()
            return _say(f"error: {_place(error)}: {error.strerror}", code)
        if os.environ.get("KNITTEST_DEBUG"):
            raise
        if stops and stops.asked:
            return _say(f"stopped by {stops.asked}", INTERRUPTED)
        return _say(f"internal error: {error or type(error).__name__}; please report it with {_log()}", 1)


def _place(error: OSError) -> str:
    """Place of the error; one without a file is of what the command prints."""
    from knittest.base.files import excerpt

    return "standard output cannot be written" if error.filename is None else excerpt(os.fsdecode(error.filename))


def _leave(code: int) -> None:
    """End at once, all being saved: a compiler or a pool of threads stopped anywhere may crash when it is torn down."""
    with suppress(OSError):
        sys.stdout.flush()
        sys.stderr.flush()
    os._exit(code)


def _print_nowhere() -> int:
    """Let nothing more be written to a closed pipe or a full disk, not even when the process ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _say(text: str, code: int) -> int:
    with _even_if_nobody_reads():
        click.echo(f"knittest: {text}", err=True)
    return code


@contextmanager
def _even_if_nobody_reads() -> Iterator[None]:
    """Let the exit code stand where standard error cannot be written: on a full disk, or closed."""
    try:
        yield
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


def _log() -> Path:
    """Keep the traceback in a file for a bug report."""
    with tempfile.NamedTemporaryFile("w", prefix="knittest-", suffix=".log", delete=False, encoding="utf-8") as stream:
        stream.write(traceback.format_exc())
    return Path(stream.name)


if __name__ == "__main__":
    main()
