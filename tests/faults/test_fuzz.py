"""Any file is read or refused with :class:`InputError`, at once and in bounded memory; also shipped files gone wrong.

The same cases in every run (derandomized), some 20 s together.
"""

import os
import random
import re
import resource
import sys
import time
import tracemalloc
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from strip_reading import read_lab

from knittest.base.errors import InputError
from knittest.base.files import configs_dir, data_dir
from knittest.config.loading import resolve
from knittest.config.yaml_loader import load_yaml
from knittest.experiment import lab_rows
from knittest.experiment.curves import load_curve

SECONDS = 2.0
MEBIBYTES = 64

CONFIGS = {path.name: path.read_text(encoding="utf-8") for path in sorted(configs_dir().rglob("*.yaml"))}
EXPORTS = (
    "Prüfprotokoll;Zwick\nEinspannlänge;200;mm\nBreite: 50,0 mm\n\nWeg;Kraft\nmm;kN\n"
    "0,0;0,0\n1,0;1,25\n2,5;3,5\n3,75;1.250,5\n",
    "Strain [%],Force (cN)\n0,0\n0.5,100\n1.5,3e2\n2.5,1000.25\n",
    "b0;100\nWeg\tKraft\tWeg\tKraft\nmm\tN\tmm\tN\n0\t0\t0\t0\n1\t10\t1\t20\n2\t40\t2\t50\n\t\t3\t90\n",
)
CURVE = (data_dir() / "pham2019" / "curves" / "tensile-v1-warp.csv").read_text(encoding="utf-8")
#: what a value may be replaced by: other types, bombs, numbers at the edge, names that are paths
VALUES = [
    *("", "~", "true", "no", "[]", "{}", "[[1, 2], 3]", "{value: []}", "{a: {b: 1}}", "- 1", "|", "? x", "a: b: c"),
    *("-1", "0", "012", "1e-3", "1e308", "-1e308", "1e400", ".nan", "-.inf", "9" * 18, "9" * 400, "0xffffffff"),
    *("3,5", "1.234", "1.234,5", "12:30:45", "'x'", '"\\0"', '"a\\nb"', "nan", "inf", "'''", '"', ";;;;", "\t\t"),
    *("&a [*a]", "*a", "<<: {}", "!!int 3", "!!python/object/apply:os.system [ls]", "../../x", "/dev/zero", "<b>"),
    *("\u202e", "\ufeff", "\x00", "\x85", "é", "１２", "٣", "x" * 3000, "(" * 3000, "1" * 3000 + "x", "/ " * 1500),
]
VALUE = re.compile(r"(?<=: )[^,}\n{\[]+|\{[^}\n]*\}|\[[^\n]*\]|[\d.,]+|\w+")


def mutated(text: str, seed: int) -> bytes:
    """``text`` after one to three accidents with bytes, lines or values."""
    generator = random.Random(seed)
    raw = text.encode(generator.choice(["utf-8"] * 5 + ["utf-16", "latin-1"]), "replace")
    for _ in range(generator.randint(1, 3)):
        raw = generator.choice(ACCIDENTS)(raw, generator)
    return raw


def change_bytes(raw: bytes, generator: random.Random) -> bytes:
    """``raw`` with some bytes deleted or repeated, one replaced, or its end cut off."""
    at, longer = generator.randint(0, len(raw)), generator.randint(1, 40)
    byte = generator.choice([generator.randbytes(1), *(bytes([b]) for b in b":-[]{},&*!|>%@`'\"#.\\~\t\n;\0")])
    again = raw[at : at + longer] * generator.choice([1, 1, 49]) + raw[at:]
    return raw[:at] + generator.choice([raw[at + longer :], again, byte + raw[at + 1 :], b""])


def change_lines(raw: bytes, generator: random.Random) -> bytes:
    lines = raw.split(b"\n")
    k, other = generator.randrange(len(lines)), generator.randrange(len(lines))
    kept = generator.choice([[], [lines[k]] * 2, [lines[other]], [b"  " + lines[k]], [lines[k].lstrip()]])
    return b"\n".join([*lines[:k], *kept, *lines[k + 1 :]])


def change_value(raw: bytes, generator: random.Random) -> bytes:
    text = raw.decode("utf-8", "replace")
    places = list(VALUE.finditer(text))
    if not places:
        return raw
    place = generator.choice(places)
    return (text[: place.start()] + generator.choice(VALUES) + text[place.end() :]).encode()


ACCIDENTS = [*[change_bytes] * 4, change_lines, change_value, change_value]


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("fuzz")


@pytest.fixture(scope="module", autouse=True)
def imported():
    """Import and build once what counts neither as time nor as memory of a case."""
    resolve(variant="1")


def read_or_refused(path: Path, raw: bytes, read: Callable[[Path], object]) -> object:
    """Result of ``read`` on the bytes, or ``None`` if it refuses them; within time and memory."""
    path.write_bytes(raw)
    before, start = peak_memory(), time.process_time()  # of this process, as others may be busy
    try:
        found = read(path)
    except InputError as error:
        assert 0 < len(str(error)) < 20_000
        found = None
    assert time.process_time() - start < SECONDS
    assert peak_memory() - before < MEBIBYTES * 2**20
    return found


def peak_memory() -> int:
    """Largest memory of this process so far [bytes]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


def traced_memory(call: Callable[[], object]) -> int:
    """Largest memory that ``call`` holds at once [bytes]; four times as slow as the call."""
    tracemalloc.start()
    with suppress(InputError):
        call()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def judged(count: int):
    slow = [HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
    return settings(max_examples=count, deadline=None, derandomize=True, database=None, suppress_health_check=slow)


@judged(300)
@given(st.text(max_size=200) | st.lists(st.sampled_from([*VALUES, "a:", "\n", "  ", "rig", ": "])).map("".join))
def test_random_text_as_config(place, text):
    raw = text.encode("utf-8", "surrogatepass")
    document = read_or_refused(place / "rig.yaml", raw, load_yaml)
    assert document is None or isinstance(document.data, dict)


@pytest.mark.parametrize("name", CONFIGS)
@judged(130)
@given(st.integers(0, 2**32))
def test_mutated_configs(place, name, seed):
    asked = "config" if name == "tensile.yaml" else "fabric"
    variant = "2" if asked == "config" else None
    read_or_refused(
        place / name, mutated(CONFIGS[name], seed), lambda path: resolve(variant=variant, **{asked: path}).model_dump()
    )


@judged(150)
@given(st.sampled_from(VALUES), st.sampled_from(["rig.width", "fabric.macro", "fabric.name", "model.meso", "x"]))
def test_values_given_on_the_command_line(place, value, key):
    read_or_refused(place / "unused", b"", lambda _: resolve(variant="1", sets=[f"{key}={value}"]))


@judged(400)
@given(st.integers(0, 2**32), st.sampled_from(EXPORTS))
def test_mutated_laboratory_exports(place, seed, export):
    specimens = read_or_refused(place / "export.csv", mutated(export, seed), lambda path: read_lab(path, 200.0))
    for specimen in specimens or []:
        assert np.isfinite(specimen.force).all()
        assert np.isfinite(specimen.strain).all()
        assert (np.diff(specimen.strain) > 0.0).all()


@judged(150)
@given(st.lists(st.lists(st.sampled_from([*VALUES, "Weg", "Kraft [N]", "1", "2,5"]), max_size=5), max_size=8))
def test_random_tables(place, rows):
    text = "\n".join(["Weg;Kraft", *(";".join(cells) for cells in rows)])
    read_or_refused(place / "export.csv", text.encode(), lambda path: read_lab(path, 200.0))


@judged(150)
@given(st.integers(0, 2**32))
def test_mutated_curves(place, seed):
    read_or_refused(place / "curve.csv", mutated(CURVE, seed), load_curve)


HEAD = "Weg;Kraft\nmm;N\n"
#: tables whose reading would take time or memory with a power of their size
HOSTILE = {
    "one long number that is none": HEAD + "1" * 130_000 + "x;1\n",
    "brackets": "Weg " + "[" * 100_000 + ";Kraft\n0;0\n1;1\n",
    "blanks": "Weg (" + " " * 100_000 + "x;Kraft\n0;0\n1;1\n",
    "slashes": "Weg " + "/" * 19_000 + " x;Kraft\n0;0\n1;1\n",
    "columns": "Weg;Kraft;" * 40_000 + "\n" + "0;" * 80_000 + "\n",
    "columns that fit": "Weg;Kraft;" * 1_900 + "\n" + "0;" * 3_800 + "\n",
    "cells in one row": HEAD + "11;" * 1_000_000,
    "quoted rows": HEAD + '"\n";' * 300_000,
    "open quote": HEAD + '"' + "1;1\n" * 300_000,
    "empty lines": HEAD + "\n" * 100_000,
    "no table": "Bemerkung;x\n" * 20_000,
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_tables(place, name):
    path = place / "export.csv"
    read_or_refused(path, HOSTILE[name].encode(), lambda path: read_lab(path, 200.0))
    assert traced_memory(lambda: read_lab(path, 200.0)) < 40 * len(HOSTILE[name]) + 1.2 * lab_rows.MAX_BYTES


def test_memory_at_the_limits(place, monkeypatch):
    """At a fortieth of the limits, so that the test is quick, a fortieth of 0.6 GB."""
    monkeypatch.setattr(lab_rows, "MAX_BYTES", lab_rows.MAX_BYTES // 40)
    monkeypatch.setattr(lab_rows, "MAX_ROWS", lab_rows.MAX_ROWS // 40)
    path, count = place / "export.csv", lab_rows.MAX_ROWS - 5
    rows = "".join(f"{k / 1000};{k % 977};{k / 1000};{k % 991}\n" for k in range(count))
    many = ("12;" * 6_000 + "\n") * (lab_rows.MAX_BYTES // 18_001)
    for text, readable in (("Weg;Kraft;Weg;Kraft\n" + rows, True), (HEAD + many, False), (many, False)):
        found = read_or_refused(path, text.encode(), lambda path: read_lab(path, 200.0, "."))
        assert (found is not None) == readable
        assert traced_memory(lambda: read_lab(path, 200.0, ".")) < 0.6e9 / 40
    for text, phrase in (("1;1\n" * lab_rows.MAX_ROWS, "rows"), ("1;1\n" * (lab_rows.MAX_BYTES // 4), "larger than")):
        path.write_text(HEAD + text)
        with pytest.raises(InputError, match=phrase):
            read_lab(path, 200.0)


def test_endless_and_blocking_files_are_refused_at_once(place):
    with suppress(FileExistsError):
        os.mkfifo(place / "pipe")
    for path in ("/dev/zero", "/dev/urandom", place / "pipe", place, "bad\0name"):
        for read in (read_lab, load_curve):
            start = time.perf_counter()
            with pytest.raises(InputError):
                read(Path(path))
            assert time.perf_counter() - start < SECONDS


@pytest.mark.parametrize(
    ("text", "phrase"),
    [
        ("Weg;Kraft\n0,5;1.234,5\n1,0;2.5\n", ":3: '2.5' is not a number with decimal mark ','"),
        ("Weg;Kraft\n0,5;1.234,5\n1,0;1,234.5\n", ":3: '1,234.5' is not"),
        ("Weg,Kraft\n0,0\n1,5,3,2\n", ":3: 4 cells below 2 columns"),
        ("Weg;Kraft [kN]\n0;0\n1;1e308\n", ":3: specimen export: no finite force"),
    ],
)
def test_numbers_that_were_once_read_wrong(tmp_path, text, phrase):
    path = tmp_path / "export.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"export\.csv") as caught:
        read_lab(path, 200.0)
    assert phrase in str(caught.value)
    for delimiter in ("", ";;", '"', "\n"):
        with pytest.raises(InputError, match="expected one character"):
            read_lab(path, 200.0, None, delimiter)
