"""Passwords and, if a user wants it so, the machine's name stay out of files and messages."""

import json
import re
import socket
import sys
import types

import pytest
import yaml
from calibration_cases import Pretending, calibrate

from knittest.base.errors import KnittestError, ResourceError
from knittest.base.machine import hide_passwords, host_name
from knittest.config.loading import resolve
from knittest.export.lock import RunLock
from knittest.export.summary import first_manifest, resume_manifest
from knittest.studies.calibrate import command
from knittest.studies.calibrate.optuna_search import convert_database_errors, hide_storage_password, open_storage
from knittest.studies.trials.trial import Record

WORD = "ge:h/eim"


@pytest.mark.parametrize(
    ("url", "shown"),
    [
        (f"postgresql://me:{WORD}@host:5432/name", "postgresql://me:***@host:5432/name"),
        (f"mysql+pymysql://:{WORD}@host/name", "mysql+pymysql://:***@host/name"),
        (f"mysql://host/name?user=me&password={WORD}&ssl=1", "mysql://host/name?user=me&password=***&ssl=1"),
        (f"mysql://host/name?PASSWD={WORD}", "mysql://host/name?PASSWD=***"),
        (f"two a://b:{WORD}@c and d://e:{WORD}@f", "two a://b:***@c and d://e:***@f"),
        ("postgresql://me@host/name", "postgresql://me@host/name"),
        ("sqlite:///a/b.db", "sqlite:///a/b.db"),
        ("ratio 1:2 of x@y.z", "ratio 1:2 of x@y.z"),
    ],
)
def test_passwords_of_urls(url, shown):
    assert hide_passwords(url) == shown


SPELLINGS = [
    f"storage: postgresql://me:{WORD}@host/name",
    f"storage: 'postgresql://me:{WORD}@host/name'  # no. 1",
    'storage: "postgresql://me:ge\\u003ah\\x2feim@host/name"',
    'storage: "postgresql://me:ge:h\\\n  /eim@host/name"',
    f"storage: >-\n  postgresql://me:{WORD}@host/name",
    f"storage: postgresql://me@host/name?password={WORD}",
]


@pytest.mark.parametrize("spelled", SPELLINGS)
def test_however_it_is_written_in_the_file(spelled):
    text = f"a: 1\n{spelled}\nb: 2  # was x://y:{WORD}@z\n"
    storage = yaml.safe_load(text)["storage"]
    assert WORD in storage
    copy = hide_storage_password(text, storage)
    assert "eim" not in copy
    assert yaml.safe_load(copy) == {"a": 1, "b": 2, "storage": hide_passwords(storage)}
    assert [n for n, line in enumerate(copy.splitlines()) if line.startswith("b:")] == [text.count("\n") - 1]


def test_a_file_without_a_password_is_copied_as_it_is():
    text = "a: 1\nstorage: sqlite:///x.db\n"
    assert hide_storage_password(text, "sqlite:///x.db") == text
    assert hide_storage_password("a: 1\n", None) == "a: 1\n"


CALIBRATION = """
base: {{variant: 1, scale: macro, preset: quick}}
parameters:
  fabric.macro.bending_stiffness.warp: {{low: 1, high: 20, spacing: log}}
tests:
  bend: {{test: cantilever, direction: warp, set: {{rig.mode: overhang}}}}
targets:
  - {{test: bend, quantity: overhang_mm}}
method: optuna
max_runs: 60
storage: "{url}"
"""


def test_nothing_of_a_calibration_keeps_the_password(tmp_path, monkeypatch, capsys):
    """With a real search; the server is played by SQLite, which is told the rest of the URL."""
    optuna = pytest.importorskip("optuna")
    asked = f"postgresql://me:{WORD}@host/name"

    def opened(url, where):
        assert url == asked
        return optuna.storages.RDBStorage(f"sqlite:///{tmp_path / 'server.db'}")

    monkeypatch.setattr(command.database, "open_storage", opened)
    monkeypatch.setattr(command.database, "url_without_password", lambda storage: hide_passwords(asked))
    assert calibrate(CALIBRATION.format(url=asked), tmp_path, monkeypatch, Pretending()) == 0
    said = capsys.readouterr()
    folder = tmp_path / "runs" / "calibrate-c"
    files = [p for p in folder.rglob("*") if p.is_file()]
    assert {"calibration.yaml", "calibration.json"} <= {p.name for p in files}
    texts = {
        p.name: re.sub(rb"base64,[A-Za-z0-9+/=]+", b"", p.read_bytes()) for p in files
    }  # pictures have any letters
    assert [name for name, text in texts.items() if b"eim" in text] == []
    assert "eim" not in said.out + said.err
    assert "postgresql://me:***@host/name" in (folder / "calibration.yaml").read_text()


def test_no_message_carries_it(monkeypatch):
    pytest.importorskip("optuna")
    urls = [
        f"nonsense://me:{WORD}@host/name", f"postgresql+nodriver://me:{WORD}@host/name", f"me:{WORD}@host",
        f"postgresql://me:{WORD}@127.0.0.1:1/name?password={WORD}",
    ]  # fmt: skip
    monkeypatch.setitem(sys.modules, "psycopg2", types.ModuleType("psycopg2"))
    for url in urls:
        with pytest.raises(KnittestError) as refused:
            open_storage(url, "--storage")
        assert "eim" not in str(refused.value), url
    with pytest.raises(ResourceError) as lost, convert_database_errors("--storage: x"):
        raise RuntimeError(f"could not connect to postgresql://me:{WORD}@host/name\nmore")
    assert "eim" not in str(lost.value) and "more" not in str(lost.value)


@pytest.mark.parametrize(("given", "name"), [(None, socket.gethostname()), ("", ""), ("bench-3", "bench-3")])
def test_the_machines_name_is_optional(given, name, tmp_path, monkeypatch):
    monkeypatch.delenv("KNITTEST_HOST", raising=False)
    if given is not None:
        monkeypatch.setenv("KNITTEST_HOST", given)
    assert host_name() == name
    run = resolve(variant="1", scale="macro", direction="warp")
    manifest = first_manifest(run, "", 1, [], None)
    assert manifest["host"] == resume_manifest(manifest, 1, {})["host"] == Record("k", "failed").host == name
    lock = RunLock(tmp_path)
    assert json.loads((tmp_path / "run.lock").read_text())["host"] == name
    with pytest.raises(ResourceError, match=r"in use by process \d+" + (f" on {name}" if name else ";")):
        RunLock(tmp_path)
    lock.release()
