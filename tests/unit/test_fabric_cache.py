"""Relaxed cells come back from the cache bit by bit; what cannot be trusted is relaxed again."""

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from fabric_cases import crimped, points_of, relaxed, spec, with_points

from knittest.base.interrupts import Interrupts
from knittest.config.loading import resolve
from knittest.export.identity import cell_of, changes, identity_of
from knittest.export.summary import first_manifest
from knittest.fabric import relaxation
from knittest.fabric.cell import Cell, cell_digest, cell_path, load_cell, save_cell
from knittest.runs.execute import _open_folder
from knittest.runs.opened_run import NewFolder
from knittest.studies.command import _parallel_runs


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("KNITTEST_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr(relaxation, "_cells_in_memory", {})
    return tmp_path / "cache"


def assert_same(one: Cell, two: Cell) -> None:
    assert [(c.system, c.index) for c in one.curves] == [(c.system, c.index) for c in two.curves]
    for first, second in zip(one.curves, two.curves, strict=True):
        np.testing.assert_array_equal(first.points, second.points)
        np.testing.assert_array_equal(first.period, second.period)
    for name in ("deepest", "worst", "residual", "iterations"):
        assert getattr(one, name) == getattr(two, name)


def test_a_saved_cell_comes_back_with_its_digest(own_cache):
    cell = relaxed("V1")
    assert load_cell(cell.spec) is None
    save_cell(cell)
    back = load_cell(cell.spec)
    assert back is not None and cell_digest(back) == cell_digest(cell)
    assert_same(cell, back)
    assert [p.name for p in (own_cache / "cells").iterdir()] == [cell_path(cell.spec).name]


def test_every_input_has_its_own_file():
    base = spec("V1")
    warp, weft = base.layers
    others = [replace(base, **{n: 1.01 * v}) for n, v in vars(base).items() if isinstance(v, float)]
    changed = [replace(warp, **{n: 1.01 * v}) for n, v in vars(warp).items() if isinstance(v, float)]
    changed += [replace(warp, pattern=(True, False)), replace(warp, name="warp1"), replace(warp, direction="weft")]
    others += [replace(base, layers=(one, weft)) for one in changed]
    others += [
        replace(base, layers=(weft, warp)),
        replace(base, stitches=((1, -1),)),
        replace(base, stitches=((1, 1),)),
    ]
    assert len({cell_path(one) for one in [base, *others]}) == len(others) + 1 == 16


DAMAGE = "garbage,truncated,flipped,empty,nan,shape,missing,scaled,unsealed,of other inputs"


@pytest.mark.parametrize("damage", DAMAGE.split(","))
def test_a_damaged_file_is_relaxed_again(damage, monkeypatch, capsys):
    cell = relaxed("V1")
    save_cell(cell)
    path = cell_path(cell.spec)
    whole = path.read_bytes()
    if damage == "nan":
        save_cell(with_points(cell, "warp", np.full((16, 3), np.nan)))
    elif damage == "shape":
        save_cell(with_points(cell, "knit", points_of(cell, "knit")[:, :2]))
    elif damage == "missing":
        np.savez(path, **{"knit-0": points_of(cell, "knit")})
    elif damage in ("scaled", "unsealed"):
        with np.load(path) as archive:
            arrays = dict(archive)
        arrays |= {"knit-0": 1.01 * arrays["knit-0"]} if damage == "scaled" else {}
        np.savez(path, **{k: v for k, v in arrays.items() if damage == "scaled" or k != "sha256"})
    elif damage == "of other inputs":
        other = replace(cell, spec=replace(cell.spec, wale=1.01 * cell.spec.wale))
        save_cell(other)
        cell_path(other.spec).rename(path)
    else:
        flipped = whole[:2000] + bytes([whole[2000] ^ 0xFF]) + whole[2001:]
        path.write_bytes({"garbage": b"no zip", "truncated": whole[:900], "flipped": flipped, "empty": b""}[damage])
    assert load_cell(cell.spec) is None
    said = capsys.readouterr().err
    assert path.stem in said and "the cached cell is relaxed again" in said
    calls = []
    monkeypatch.setattr(relaxation, "relax_cell", lambda wanted: calls.append(wanted) or cell)
    monkeypatch.setattr(relaxation.CellSpec, "of", classmethod(lambda cls, fabric: cell.spec))
    for _ in range(2):
        assert_same(relaxation.relaxed_cell(None), cell)
        relaxation._cells_in_memory.clear()
    assert calls == [cell.spec]


def test_a_process_stands_on_one_cell(monkeypatch):
    cell = relaxed("V1")
    save_cell(cell)
    monkeypatch.setattr(relaxation.CellSpec, "of", classmethod(lambda cls, fabric: cell.spec))
    first = relaxation.relaxed_cell(None)
    save_cell(with_points(cell, "knit", 1.01 * points_of(cell, "knit")))  # by somebody else, while we run
    assert relaxation.relaxed_cell(None) is first


def test_the_digest_of_a_cell_is_that_of_its_numbers_and_inputs():
    cell = relaxed("V1")
    others = [with_points(cell, s, np.nextafter(points_of(cell, s), 1e9)) for s in cell.spec.systems]
    others.append(replace(cell, deepest=np.nextafter(cell.deepest, 1e9)))
    others.append(replace(cell, spec=crimped(cell.spec, 0.0061)))
    assert len({cell_digest(c) for c in [cell, *others]}) == len(others) + 1


def test_the_cell_is_part_of_what_a_run_is(monkeypatch):
    cell = relaxed("V1")
    cells = {"here": cell, "there": with_points(cell, "knit", 1.01 * points_of(cell, "knit"))}
    yarns, shells = (resolve(variant="1", scale=scale, direction="warp") for scale in ("meso", "macro"))
    found = {}
    for place, cell in cells.items():
        monkeypatch.setattr("knittest.export.identity.relaxed_cell", lambda fabric, compute=None, cell=cell: cell)
        found[place] = identity_of(yarns, [])
        assert cell_of(yarns) == found[place]["cell"] == cell_digest(cell)
        assert first_manifest(yarns, "", 1, [], cell_of(yarns))["cell_sha256"] == cell_digest(cell)
    was, now = (cell_digest(cells[place]) for place in ("here", "there"))
    assert changes(found["here"], found["there"]) == [f"cell was {was}, is {now}"]
    assert cell_of(shells) is None and "cell" not in identity_of(shells, [])


@pytest.mark.parametrize("cached", [False, True])
def test_the_relaxation_is_announced_once_by_runs_in_parallel_and_only_where_there_is_one(
    tmp_path, monkeypatch, cached
):
    monkeypatch.setattr(relaxation, "load_cell", lambda spec: relaxed("V1") if cached else None)
    monkeypatch.setattr(relaxation, "relax_cell", lambda spec: relaxed("V1"))
    monkeypatch.setattr("numba.get_num_threads", lambda: 2)
    runs = [resolve(variant="1", scale="meso", direction=direction) for direction in ("warp", "weft")]
    places = [NewFolder(tmp_path / run.direction) for run in runs]
    phases: list[str] = []
    progress = SimpleNamespace(phase=phases.append)
    _parallel_runs(list(zip(runs, places, strict=True)), progress)
    with Interrupts() as interrupts, interrupts.translate_errors():
        for run, place in zip(runs, places, strict=True):
            with _open_folder(run, place, interrupts, progress):
                pass
    assert phases == ([] if cached else ["relaxing geometry"])


class Hostile:
    """Makes a folder when it is unpickled."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.folder),)


def test_pickles_are_not_read(tmp_path):
    cell = relaxed("V1")
    save_cell(cell)
    trap = {"knit-0": np.array([Hostile(tmp_path / "trap")], dtype=object), "warp-0": points_of(cell, "warp")}
    np.savez(cell_path(cell.spec), **trap)
    assert load_cell(cell.spec) is None
    assert not (tmp_path / "trap").exists()


def test_a_full_disk_costs_only_time(own_cache, monkeypatch):
    monkeypatch.setattr(np, "savez", Mock(side_effect=OSError(28, "No space left on device")))
    save_cell(relaxed("V1"))
    assert list((own_cache / "cells").iterdir()) == []
