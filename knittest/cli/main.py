"""Entry point of the ``knittest`` command: table of subcommands, loaded when used, and exit codes."""

import errno
import importlib
import io
import os
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import click

from knittest import __version__
from knittest.base.errors import OUT_OF_MEMORY, InputError, KnittestError, ResourceError, is_out_of_memory
from knittest.base.interrupts import INTERRUPTED, STOPPING, ProcessSignalHandler
from knittest.base.kinds import kinds
from knittest.config.aliases import OldNameWarning

#: heading of ``--help`` under which the tests and the commands that begin one stand
TESTS = "Tests"
#: commands that are no test, by the heading of ``--help``: name, module that defines it under the same name, summary
HEADINGS = {
    TESTS: {
        "demo": ("testing", "Run a small example and explain its report."),
        "check": ("testing", "Check size, run time and consistency of a run before it starts."),
        "resume": ("testing", "Resume an interrupted run."),
    },
    "Fabrics and data": {
        "new": ("system", "Write a commented fabric file and rig file to start from."),
        "fabric": ("fabric", "Relax, draw or export the yarn geometry."),
        "data": ("data", "Import and summarise files of testing machines."),
        "schema": ("system", "Explain a config field, or print the JSON schema of a run."),
    },
    "Studies": {
        "batch": ("studies", "Run a parameter sweep, on this machine or a cluster."),
        "calibrate": ("studies", "Fit parameters to measured results."),
        "uncertainty": ("studies", "Propagate the uncertainty of assumed parameters."),
        "homogenise": ("studies", "Derive the macro material card from meso simulations."),
        "speed-study": ("studies", "Repeat every test at half its speed."),
        "regress": ("studies", "Compare with Table 3 and with a stored baseline, for CI."),
    },
    "Results": {
        "runs": ("pages", "List or remove run folders."),
        "report": ("pages", "Write one HTML report on one or several runs."),
        "compare": ("pages", "Compare a finished run with a measured curve."),
        "view": ("pages", "Write a page that shows a run in 3D, to turn and play."),
        "animate": ("pages", "Write a film of a run (MP4 or GIF)."),
        "export": ("export", "Export solver decks, workbooks, yarns and tools of a run."),
    },
    "Setup": {
        "doctor": ("system", "Report versions, threads and cache."),
        "warmup": ("system", "Compile all kernels now."),
        "bench": ("system", "Measure the speed of the kernels."),
    },
}
#: the same by name
COMMANDS = {name: entry for commands in HEADINGS.values() for name, entry in commands.items()}
#: full disk, quota, read-only file system, missing permission: a fault of the machine, not of the program
NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES)
#: a path that no file can have
NO_PATH = (errno.ENAMETOOLONG, errno.ELOOP, errno.ENOTDIR)


class LazyGroup(click.Group):
    """Group that imports a command's module only when the command is used, so that ``--help`` is quick."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names in the order of the help."""
        return list(summaries())

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Command of that name, or None."""
        if cmd_name in COMMANDS:
            module = importlib.import_module(f"knittest.cli.{COMMANDS[cmd_name][0]}")
            command: click.Command = getattr(module, cmd_name.replace("-", "_"))
            return command
        if cmd_name not in kinds():
            return None
        from knittest.cli.testing import test_command

        return test_command(kinds()[cmd_name])

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; a closed pipe ends it without an error (click would exit with 1)."""
        try:
            return super().invoke(ctx)
        except BrokenPipeError:
            return _discard_output()

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands by their headings, without importing them."""
        lines = summaries()
        for heading, commands in HEADINGS.items():
            tests = [name for name in lines if name not in COMMANDS] if heading == TESTS else []
            with formatter.section(heading):
                formatter.write_dl([(name, lines[name]) for name in [*tests, *commands]], col_spacing=2)


def summaries() -> dict[str, str]:
    """Line of ``--help`` for each command, the tests first; raises :class:`InputError` for a test named like one."""
    tests = {name: kind.summary for name, kind in kinds().items()}
    if taken := sorted(tests.keys() & COMMANDS.keys()):
        raise InputError(f"test {taken[0]}: knittest has a command of this name: uninstall the test's package")
    return tests | {name: text for name, (_, text) in COMMANDS.items()}


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="knittest")
def cli() -> None:
    """Virtual material tests of biaxial weft-knitted fabrics.

    Example: knittest demo
    """


def _show_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, *_: object, **__: object
) -> None:
    """Show the warning of an old name in a line; others as Python does."""
    text = f"warning: {message}\n" if issubclass(category, OldNameWarning) else None
    with suppress(OSError):  # as Python does where the stream is gone
        sys.stderr.write(text or warnings.formatwarning(message, category, filename, lineno))


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit with its code; no traceback reaches the user."""
    # A file of a run must not take the descriptor of a stream that was closed before the start: 0, 1 and 2 come first.
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: PTH123, SIM115 - to the end
    if isinstance(sys.stdout, io.TextIOWrapper):  # as standard error: a terminal without a letter shows another
        sys.stdout.reconfigure(errors="backslashreplace")
    stops = ProcessSignalHandler()
    stops.install()
    report = sys.__unraisablehook__  # but not a signal in a library's callback, which is noted already
    sys.unraisablehook = lambda lost: None if isinstance(lost.exc_value, KeyboardInterrupt) else report(lost)
    warnings.showwarning = _show_warning
    for library in ("OPENBLAS", "MKL"):  # small systems: threads only wait for each other, long on a busy machine
        os.environ.setdefault(f"{library}_NUM_THREADS", "1")
    try:
        code = run(arguments, stops)
        for number in STOPPING:  # all is done: until the interpreter has ended too, there is nothing to stop
            signal.signal(number, signal.SIG_IGN)
    except KeyboardInterrupt:  # a second signal, while the first one was being reported
        code = INTERRUPTED
    if code == INTERRUPTED:  # all is saved; a compiler or thread pool that a signal stopped may crash at a normal exit
        with suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code)
    sys.exit(code)


def run(arguments: list[str] | None = None, stops: ProcessSignalHandler | None = None) -> int:
    """Run the command line and return the exit code; an error that follows a signal noted by ``stops`` counts as it."""
    try:
        result = cli.main(args=arguments, standalone_mode=False)
        sys.stdout.flush()
        return result if isinstance(result, int) else 0
    except click.exceptions.Abort as error:  # click's word for a KeyboardInterrupt
        return _print_message(str(error.__cause__ or "") or "interrupted", INTERRUPTED)
    except KeyboardInterrupt as error:
        return _print_message(str(error) or "interrupted", INTERRUPTED)
    except click.ClickException as error:
        with _ignore_closed_stderr():
            error.show()
        return 2
    except KnittestError as error:
        return _print_message(f"error: {error}", error.exit_code)
    except BrokenPipeError:
        return _discard_output()
    except Exception as error:
        if is_out_of_memory(error):
            return _print_message(f"error: {OUT_OF_MEMORY}", ResourceError.exit_code)
        if isinstance(error, OSError) and error.errno in NO_ROOM + NO_PATH:
            return _report_os_error(error)
        if os.environ.get("KNITTEST_DEBUG"):
            raise
        if stops and stops.asked:
            return _print_message(f"stopped by {stops.asked}", INTERRUPTED)
        with tempfile.NamedTemporaryFile("w", prefix="knittest-", suffix=".log", delete=False, encoding="utf-8") as log:
            log.write(traceback.format_exc())
        return _print_message(f"internal error: {error or type(error).__name__}; please report it with {log.name}", 1)


def _report_os_error(error: OSError) -> int:
    """Print the file and its error; without a file, the error is one of the command's own output."""
    from knittest.base.files import excerpt

    if error.filename is None:
        _discard_output()
    place = "standard output cannot be written" if error.filename is None else excerpt(os.fsdecode(error.filename))
    code = (InputError if error.errno in NO_PATH else ResourceError).exit_code
    return _print_message(f"error: {place}: {error.strerror}", code)


def _discard_output() -> int:
    """Write nothing more to a closed pipe or a full disk, not even when the process ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 0


def _print_message(text: str, code: int) -> int:
    with _ignore_closed_stderr():
        click.echo(f"knittest: {text}", err=True)
    return code


@contextmanager
def _ignore_closed_stderr() -> Iterator[None]:
    """Keep the exit code where standard error cannot be written: on a full disk, or closed."""
    try:
        yield
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stderr.fileno())


if __name__ == "__main__":
    main()
