"""The tests of a laboratory that can be imported: how each is read, shown and written."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from knittest.base.errors import InputError
from knittest.experiment.lab_conditions import Condition
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_guess import hinted
from knittest.experiment.lab_kind import LAB_TESTS, directed

#: options of the command that say how a curve is meant, by their names in ``Given``
SAID = ("sign", "zero", "preload", "faces", "clamped", "loading")


def conditions() -> list[Condition]:
    """Conditions that any of the tests takes, each once."""
    return list({one.key: one for lab in LAB_TESTS.values() for one in lab.conditions}.values())


def read_files(test: str, files: Sequence[Path], options: Mapping[str, Any]) -> list[Any]:
    """Specimens of ``test`` in ``files``; ``options`` are those of the command by name, ``None`` where not given.

    Raises :class:`InputError` for an option that ``test`` has no use for, and as its reader does.
    """
    kind = LAB_TESTS[test]
    sizes = {}
    for what in conditions():
        value = options.get(_field(what.option))
        if value is None:
            continue
        if what not in kind.conditions:
            raise _useless(what.option, test)
        sizes[what.key] = value
    said = {name: options[name] for name in SAID if options.get(name) is not None}
    for name in said:
        if name not in kind.options:
            raise _useless(f"--{name}", test)
    given = Given(options.get("decimal"), options.get("delimiter"), sizes=sizes, **said)
    return [specimen for path in files for specimen in _read(test, path, given)]


def _read(test: str, path: Path, given: Given) -> Sequence[Any]:
    try:
        return LAB_TESTS[test].read(path, given)
    except InputError as error:
        raise hinted(error, test, path, given.delimiter) from None


def write_files(test: str, specimens: Sequence[Any], out: Path, direction: str | None, **how: Any) -> str:
    """Write what :func:`read_files` read into the experiment ``out``; returns its variant.

    ``how``: ``files``, their names, and ``trusted``, whether ``direction`` counts where a file names the other. Raises
    :class:`InputError` for a direction that is missing, or that the test has not.
    """
    kind = LAB_TESTS[test]
    if directed(test) and direction is None:
        raise InputError(f"--direction: missing: which yarn system runs along the strips, warp or weft? ({test})")
    if not directed(test) and direction is not None:
        raise _useless("--direction", test)
    return kind.write(specimens, out, direction or "", how["files"], how["trusted"])


def _field(option: str) -> str:
    return option.removeprefix("--").replace("-", "_")


def _useless(option: str, test: str) -> InputError:
    kind = LAB_TESTS[test]
    known = [*(what.option for what in kind.conditions), *(f"--{name}" for name in kind.options)]
    return InputError(f"{option}: has no meaning for --test {test}; it takes {', '.join(known)}")
