"""Tests as functions that return their runs."""

import threading
import warnings
from collections.abc import Callable, Sequence
from inspect import Parameter, Signature
from os import PathLike
from pathlib import Path
from typing import Any, TypedDict

from knittest.api.fabric import Fabric, FabricLike, Sets, settings_of, to_yaml_value
from knittest.api.run import Run, Runs, load
from knittest.base.errors import InputError, RefusedWarning
from knittest.base.kinds import TestKind, kinds
from knittest.config.fields import all_paths, most_similar_name
from knittest.config.loading import resolve_test_runs
from knittest.config.messages import unknown_name_text
from knittest.config.settings import Setting
from knittest.runs.options import RunOptions

#: compiled kernels share one pool of threads: a second run in the process waits for the first
_ONE_AT_A_TIME = threading.Lock()


class Options(TypedDict, total=False):
    """Arguments of every test, as of its command: README and the reference of the command line describe them.

    ``set`` has fields by path in their own units, ``{"rig.width": 50}`` [mm]; ``out`` is the folder,
    ``runs/<name>-<time>`` in the working folder unless stated.
    """

    scale: str | None
    preset: str | None
    direction: str | None
    parameters: str | None
    specimens: int | None
    seed: int | None
    set: Sets
    config: PathLike[str] | str | None
    out: PathLike[str] | str | None
    threads: int | None
    quiet: bool
    frames: bool
    pictures: bool
    verify: bool
    accept_limits: bool
    against: PathLike[str] | str | Sequence[PathLike[str] | str]


#: defaults of options that may not be None
DEFAULTS: dict[str, Any] = {
    "set": (), "quiet": False, "frames": True, "pictures": True, "verify": False, "accept_limits": False, "against": (),
}  # fmt: skip


def run_test(test: str, fabric: FabricLike | None = None, **given: Any) -> Run | Runs:
    """Run the test of that name, also one of another package; returns the run, or the runs of both directions.

    Warns with :class:`RefusedWarning` if quality checks fail. Raises ``TypeError`` for an unknown argument,
    :class:`InputError` for a bad value, and the error of a failed run; ``KeyboardInterrupt`` leaves a folder for
    :func:`resume`.
    """
    name = str(test).replace("_", "-")
    if name not in kinds():
        raise InputError(f"test = {test!r}: {unknown_name_text(name, list(kinds()), 'test')}")
    _check_arguments(kinds()[name], given)
    runs = resolve_test_runs(name, given.get("direction"), _resolve_arguments(kinds()[name], fabric, given))
    options = _run_options(given)
    from knittest.studies.command import run_all

    with _ONE_AT_A_TIME:
        folders = [outcome.folder for outcome in run_all(runs, options)]
    return _warn_if_rejected(Run(folders[0]) if len(folders) == 1 else load(folders[0].parent))


def resume(
    folder: PathLike[str] | str, *, force: bool = False, threads: int | None = None, quiet: bool = False
) -> Run | Runs:
    """Resume the run in ``folder``, or both directions in it; results are bitwise identical to an uninterrupted run.

    Raises :class:`InputError` if there is nothing to resume, or if something changed, unless ``force``.
    """
    from knittest.studies.command import resume_all

    with _ONE_AT_A_TIME:
        resume_all(Path(folder), _run_options({"threads": threads, "quiet": quiet}), force)
    return _warn_if_rejected(load(folder))


def _warn_if_rejected(run: Run | Runs) -> Run | Runs:
    if not run.quality_checks:
        text = "; ".join(run.quality_checks.refused)
        warnings.warn(f"{run.folder}: not compared with the experiment: {text}", RefusedWarning, stacklevel=4)
    return run


def _check_arguments(kind: TestKind, given: dict[str, Any]) -> None:
    """Raise ``TypeError`` for an argument that tests of ``kind`` do not have, with the nearest one."""
    known = ["fabric", *Options.__annotations__, *kind.own_fields]
    known = [name for name in known if kind.directional or name != "direction"]
    for name in given:
        if name in known:
            continue
        close = most_similar_name(name, known)
        hint = f'did you mean "{close}"?' if close else f"known: {', '.join(known)}"
        if f"rig.{name}" in all_paths(kind.name):
            hint = f'it is a field of the rig: set={{"rig.{name}": ...}}'
        raise TypeError(f"{kind.name.replace('-', '_')}() got an unexpected argument {name!r} ({hint})")


def _resolve_arguments(kind: TestKind, fabric: FabricLike | None, given: dict[str, Any]) -> dict[str, Any]:
    """Arguments of :func:`knittest.config.loading.resolve`."""
    config, direction = given.get("config"), given.get("direction")
    if fabric is None and config is None:
        raise InputError('which fabric? Give fabric="1", fabric="2" or the path of a fabric file')
    if direction not in (None, "warp", "weft", "both"):
        names = unknown_name_text(str(direction), ["warp", "weft", "both"], "direction")
        raise InputError(f"direction = {direction!r}: {names}")
    chosen = Fabric() if fabric is None else Fabric.load(fabric)
    sets = [*chosen.settings, *settings_of(given.get("set", ()), kind.name)]
    for name, field in kind.own_fields.items():
        if given.get(name) is not None:
            sets.append(Setting(tuple(field.split(".")), to_yaml_value(given[name]), f"--{name.replace('_', '-')}"))
    if given.get("verify"):
        sets.append("output.verify=true")
    named = {name: given.get(name) for name in ("scale", "preset", "parameters", "specimens", "seed")}
    return {
        "variant": chosen.variant, "fabric": chosen.file, "config": None if config is None else Path(config),
        "sets": tuple(sets), "accept_limits": bool(given.get("accept_limits", False)), **named,
    }  # fmt: skip


def _run_options(given: dict[str, Any]) -> RunOptions:
    given = DEFAULTS | given
    threads, out, against = given.get("threads"), given.get("out"), given["against"]
    if threads is not None and (isinstance(threads, bool) or not isinstance(threads, int) or threads < 1):
        raise InputError(f"threads = {threads!r}: expected a whole number from 1")
    curves = [against] if isinstance(against, str | PathLike) else against
    return RunOptions(
        out=None if out is None else Path(out),
        threads=threads,
        quiet=bool(given["quiet"]),
        frames=bool(given["frames"]),
        pictures=bool(given["pictures"]),
        against=tuple(Path(one) for one in curves),
    )


def test_function(kind: TestKind) -> Callable[..., Run | Runs]:
    """Function of the test of ``kind``; its docstring has the units of its curve and of its own arguments."""
    from knittest.laboratory.report_base import REPORTS

    def function(fabric: FabricLike | None = None, **options: Any) -> Run | Runs:
        return run_test(kind.name, fabric, **options)

    axes = REPORTS[kind.name].axes
    own = {**kind.shortcuts, **kind.texts}
    lines = [f"{one.replace('-', '_')}: {meaning}" for one, (_, meaning) in own.items()]
    words = [kind.summary, f"Curve: {axes.ylabel} over {axes.xlabel}.", *lines, str(Options.__doc__)]
    function.__module__ = "knittest"
    function.__name__ = function.__qualname__ = kind.name.replace("-", "_")
    function.__doc__ = "\n\n".join(words)
    function.__signature__ = signature(kind)  # type: ignore[attr-defined]
    return function


def signature(kind: TestKind) -> Signature:
    """Arguments of the function of ``kind``, with types and defaults, for ``help`` and editors."""
    types = {name: one for name, one in Options.__annotations__.items() if kind.directional or name != "direction"}
    for own, one in ((kind.shortcuts, float), (kind.texts, str)):
        types |= {name.replace("-", "_"): one | None for name in own}
    first = Parameter("fabric", Parameter.POSITIONAL_OR_KEYWORD, default=None, annotation=FabricLike | None)
    others = [
        Parameter(name, Parameter.KEYWORD_ONLY, default=DEFAULTS.get(name), annotation=one)
        for name, one in types.items()
    ]
    return Signature([first, *others], return_annotation=Run | Runs)
