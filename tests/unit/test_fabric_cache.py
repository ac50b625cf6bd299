"""Relaxed cells come back from the cache bit by bit; what cannot be trusted is relaxed again."""

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fabric_cases import relaxed, spec

from knittest.cache import cache_root
from knittest.fabric import relax
from knittest.fabric.cell import Cell
from knittest.fabric.cell_cache import cell_path, load_cell, save_cell


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("KNITTEST_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


def assert_same(one: Cell, two: Cell) -> None:
    for system in ("knit", "warp", "weft"):
        np.testing.assert_array_equal(getattr(one, system), getattr(two, system))
    assert (one.deepest, one.worst, one.residual, one.iterations) == (
        two.deepest,
        two.worst,
        two.residual,
        two.iterations,
    )


def test_a_saved_cell_comes_back(own_cache: Path) -> None:
    cell = relaxed("V1")
    assert load_cell(cell.spec) is None
    save_cell(cell)
    back = load_cell(cell.spec)
    assert back is not None
    assert_same(cell, back)
    assert [p.name for p in (own_cache / "cells").iterdir()] == [cell_path(cell.spec).name]


def test_every_input_has_its_own_file() -> None:
    base = spec("V1")
    paths = {cell_path(replace(base, **{name: 1.01 * value})) for name, value in vars(base).items()}
    assert len(paths | {cell_path(base)}) == len(vars(base)) + 1


@pytest.mark.parametrize("damage", ["garbage", "truncated", "flipped", "empty", "nan", "shape", "missing"])
def test_a_damaged_file_is_relaxed_again(damage: str, monkeypatch: pytest.MonkeyPatch) -> None:
    cell = relaxed("V1")
    save_cell(cell)
    path = cell_path(cell.spec)
    whole = path.read_bytes()
    if damage == "nan":
        save_cell(replace(cell, warp=np.full_like(cell.warp, np.nan)))
    elif damage == "shape":
        save_cell(replace(cell, knit=cell.knit[:, :2]))
    elif damage == "missing":
        np.savez(path, knit=cell.knit)
    else:
        flipped = whole[:2000] + bytes([whole[2000] ^ 0xFF]) + whole[2001:]
        path.write_bytes({"garbage": b"no zip", "truncated": whole[:900], "flipped": flipped, "empty": b""}[damage])
    assert load_cell(cell.spec) is None
    calls = []
    monkeypatch.setattr(relax, "relax_cell", lambda wanted: calls.append(wanted) or cell)
    monkeypatch.setattr(relax.CellSpec, "of", classmethod(lambda cls, fabric: cell.spec))
    for _ in range(2):
        assert_same(relax.relaxed_cell(None), cell)
    assert calls == [cell.spec]


class Hostile:
    """Makes a folder when it is unpickled."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.folder),)


def test_pickles_are_not_read(tmp_path: Path) -> None:
    cell = relaxed("V1")
    save_cell(cell)
    np.savez(cell_path(cell.spec), knit=np.array([Hostile(tmp_path / "trap")], dtype=object), warp=cell.warp)
    assert load_cell(cell.spec) is None
    assert not (tmp_path / "trap").exists()


def test_a_cache_that_cannot_be_written_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("KNITTEST_CACHE_DIR", str(tmp_path / "file" / "cache"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with pytest.warns(UserWarning, match="cannot be written"):
        root = cache_root()
    assert root.is_relative_to(tmp_path) and root.is_dir()


def test_a_full_disk_costs_only_time(own_cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*args: object, **kwargs: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    save_cell(relaxed("V1"))
    assert list((own_cache / "cells").iterdir()) == []
