"""Code runs from the cache of kernels: no other user may be able to put anything there."""

import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from knittest.base import cache
from knittest.base.cache import VARIABLE, cache_folder, cache_root, make_private, write_access_fault
from knittest.base.errors import InputError
from knittest.base.files import PACKAGE
from knittest.cli.main import run

OTHER = 12345


@pytest.fixture(autouse=True)
def anew(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Nothing is known of folders yet; the system's folder for temporary files and the user's are below tmp_path."""
    cache._find_usable_folder.cache_clear()
    cache._say_once.cache_clear()
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    temporary.chmod(0o1777)
    monkeypatch.setattr("tempfile.tempdir", str(temporary))
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "home" / ".cache"))


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.parametrize("bits", [0o777, 0o775, 0o757, 0o720, 0o1777])
def test_a_configured_folder_that_others_can_write_is_refused(bits, tmp_path, monkeypatch, capsys) -> None:
    folder = tmp_path / "shared"
    folder.mkdir()
    folder.chmod(bits)
    monkeypatch.setenv(VARIABLE, str(folder))
    with pytest.raises(InputError, match=f"{VARIABLE}: {folder} can be written by others .mode {bits:o}."):
        cache_root()
    assert run(["doctor"]) == 2
    error = capsys.readouterr().err
    assert str(folder) in error and "only you can write" in error and "Traceback" not in error
    folder.chmod(0o755)
    cache._find_usable_folder.cache_clear()
    assert cache_root() == folder


def test_the_way_to_a_configured_folder_counts(tmp_path, monkeypatch) -> None:
    folder = tmp_path / "open" / "cache"
    folder.mkdir(parents=True)
    folder.chmod(0o700)
    monkeypatch.setenv(VARIABLE, str(folder))
    folder.parent.chmod(0o777)
    with pytest.raises(InputError, match=f"{folder.parent} can be written by others"):
        cache_root()
    folder.parent.chmod(0o1777)  # as the folder for temporary files: nobody can exchange what is ours
    assert cache_root() == folder


def test_a_folder_inside_that_others_can_write_is_refused(tmp_path, monkeypatch) -> None:
    inside = tmp_path / "cache" / "numba"
    inside.mkdir(parents=True)
    inside.chmod(0o777)
    monkeypatch.setenv(VARIABLE, str(tmp_path / "cache"))
    with pytest.raises(InputError, match=f"{inside} can be written by others"):
        cache_folder("numba", "abc")


def test_another_users_folder_is_none_of_ours(tmp_path, monkeypatch) -> None:
    folder = tmp_path / "theirs"
    folder.mkdir(mode=0o700)
    assert write_access_fault(folder) == ""
    monkeypatch.setattr(os, "geteuid", lambda: OTHER)
    if os.getuid() == 0:  # what belongs to the system is trusted on the way, not as the folder itself
        assert write_access_fault(folder) == f"{folder} belongs to user 0"
        os.chown(folder.parent, OTHER + 1, -1)
    assert "belongs to user" in write_access_fault(folder / "..")
    monkeypatch.setenv(VARIABLE, str(folder))
    with pytest.raises(InputError, match="belongs to user"):
        cache_root()


def test_links_are_followed_and_looked_at(tmp_path) -> None:
    real, opened, link = tmp_path / "real", tmp_path / "open", tmp_path / "link"
    real.mkdir(mode=0o700)
    opened.mkdir()
    opened.chmod(0o777)
    (opened / "link").symlink_to("../real")
    link.symlink_to(opened / "link")
    assert write_access_fault(link).startswith(f"{opened} can be written")
    opened.chmod(0o755)
    assert write_access_fault(link) == ""
    (tmp_path / "round").symlink_to("round")
    with pytest.raises(OSError, match="links"):
        write_access_fault(tmp_path / "round")
    if os.getuid() == 0:  # gives a link to another user
        os.lchown(link, OTHER, -1)
        assert write_access_fault(link) == f"{link} belongs to user {OTHER}"


def spare_of(tmp_path: Path) -> Path:
    return tmp_path / "tmp" / f"knittest-cache-{os.geteuid()}"


def test_what_is_made_is_closed_to_others(tmp_path, monkeypatch) -> None:
    root = cache_root()
    assert root == tmp_path / "home" / ".cache" / "knittest"
    assert [mode(p) for p in (root, root.parent, root.parent.parent)] == [0o700] * 3
    assert mode(cache_folder("numba", "abc")) == 0o700
    before = os.umask(0o002)
    try:
        make_private(tmp_path / "a" / "b")
    finally:
        os.umask(before)
    assert write_access_fault(tmp_path / "a" / "b") == ""


def test_a_cache_that_cannot_be_written_is_replaced_by_a_private_one(tmp_path, monkeypatch, capsys) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "file" / "cache"))
    assert cache_root() == spare_of(tmp_path)
    assert mode(spare_of(tmp_path)) == 0o700
    assert "cannot be written: the cache is" in capsys.readouterr().err


@pytest.mark.parametrize("planted", ["open", "link", "theirs"])
def test_a_folder_that_was_planted_is_not_used(planted, tmp_path, monkeypatch, capsys) -> None:
    """In the folder for temporary files anybody can make the folder we would choose."""
    spare = spare_of(tmp_path)
    if planted == "link":
        (tmp_path / "trap").mkdir()
        (tmp_path / "trap").chmod(0o777)
        spare.symlink_to(tmp_path / "trap")
    else:
        spare.mkdir()
        spare.chmod(0o777 if planted == "open" else 0o755)
    if planted == "theirs":
        if os.getuid() != 0:
            pytest.skip("gives a folder to another user")
        os.chown(spare, OTHER, -1)
    (tmp_path / "home").write_text("in the way")
    assert cache_root() is None
    assert cache_folder("numba", "abc") is None
    said = capsys.readouterr().err
    assert said.count("nothing is cached") == 1 and VARIABLE in said
    assert list(spare.iterdir()) == []


def test_the_users_own_folder_left_open_is_not_used(tmp_path, capsys) -> None:
    own = tmp_path / "home" / ".cache" / "knittest"
    make_private(own)
    own.chmod(0o770)
    assert cache_root() == spare_of(tmp_path)
    assert f"{own} can be written by others" in capsys.readouterr().err


def test_two_installations_of_the_same_sources_share_their_code(tmp_path) -> None:
    """One compiles, the other loads, though its path and the dates of its files are others."""
    work = (
        "import numpy as np; from knittest.kernels.threading import _fork\n"
        "out = np.zeros(5); _fork(out); print(out.sum(), len(_fork.stats.cache_hits), len(_fork.stats.cache_misses))"
    )
    said = []
    for place in ("one", "another"):
        for room in ("base", "kernels"):
            shutil.copytree(PACKAGE / room, tmp_path / place / "knittest" / room, copy_function=shutil.copy)
        shutil.copy(PACKAGE / "__init__.py", tmp_path / place / "knittest")
        environment = os.environ | {"PYTHONPATH": str(tmp_path / place), VARIABLE: str(tmp_path / "cache")}
        command = [sys.executable, "-P", "-c", work]
        said.append(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)
    assert said == ["10.0 0 1\n", "10.0 1 0\n"]


def test_kernels_run_without_a_cache(tmp_path) -> None:
    """With a planted folder in place of the cache: nothing is read from it, nothing written, and the sum is right."""
    spare = spare_of(tmp_path)
    spare.mkdir()
    spare.chmod(0o777)
    (tmp_path / "home").write_text("in the way")
    work = (
        "import numpy as np; from knittest import kernels; from knittest.kernels.threading import _fork\n"
        "from knittest.export.identity import kernel_digest\n"
        "out = np.zeros(5); _fork(out); print(out.sum(), kernels.CODE_FOLDER, kernel_digest())"
    )
    environment = {k: v for k, v in os.environ.items() if k != VARIABLE} | {
        "TMPDIR": str(tmp_path / "tmp"), "XDG_CACHE_HOME": str(tmp_path / "home"), "PYTHONPATH": str(PACKAGE.parent),
    }  # fmt: skip
    done = subprocess.run([sys.executable, "-c", work], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("10.0 None ") and "compiled without a cache" in done.stdout
    assert "nothing is cached" in done.stderr
    assert list(spare.rglob("*")) == []
