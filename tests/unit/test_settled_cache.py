"""Settled cells are kept under a key of all that enters them, and computed again where they are not what was kept."""

import pytest

from knittest.base.cache import cache_folder
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.solve.relaxed_cell import load_or_compute, relaxed_cell_key

WHAT = {"draw_in": 0.01, "axial_share": 0.05}


def run_of(*sets: str, variant: str = "1") -> Run:
    return resolve(variant=variant, scale="meso", preset="quick", test="picture-frame", sets=sets)


@pytest.mark.parametrize(
    "changed",
    [
        "fabric.loop_length=14.5", "fabric.knitting.bending_stiffness=0.3", "fabric.contact.friction_coefficient=0.2",
        "fabric.reinforcing.crimp.warp=0.7", "fabric.knitting.degree_of_set=0.5", "model.meso.elements_per_loop=48",
        "model.meso.elements_per_wave=12", "solver.safety=0.6", "solver.target_step=0.1", "fabric.warp_density=27",
    ],
)  # fmt: skip
def test_all_that_enters_a_cell_is_in_its_key(changed: str):
    assert relaxed_cell_key(run_of(changed), WHAT) != relaxed_cell_key(run_of(), WHAT)


def test_conditions_and_the_fabric_are_in_the_key_and_the_test_is_not():
    key = relaxed_cell_key(run_of(), WHAT)
    assert key == relaxed_cell_key(run_of("solver.speed=1", "rig.side=30", "solver.damping=0.1"), WHAT)
    others = [relaxed_cell_key(run_of(), WHAT | {name: 0.011}) for name in WHAT]
    assert len({key, *others, relaxed_cell_key(run_of(variant="2"), WHAT)}) == 4


def test_a_cell_is_settled_once_and_again_where_the_file_is_damaged(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("KNITTEST_CACHE_DIR", str(tmp_path))
    settled = []

    def compute():
        settled.append(1)
        return {"draw_in": 0.01, "rest": {"tension": 0.1 + 0.2, "residual": float("nan")}}

    first, again = (load_or_compute(run_of(), WHAT, compute) for _ in range(2))
    assert len(settled) == 1 and str(first) == str(again) and again["rest"]["tension"] == 0.1 + 0.2
    load_or_compute(run_of(), WHAT | {"draw_in": 0.02}, compute)
    assert len(settled) == 2
    folder = cache_folder("settled")
    path = folder / f"{relaxed_cell_key(run_of(), WHAT)}.npz"
    path.write_bytes(path.read_bytes()[:-40])
    load_or_compute(run_of(), WHAT, compute)
    assert len(settled) == 3 and "the cached relaxed cell is computed again" in capsys.readouterr().err
    (folder / path.name).write_bytes(next(p for p in folder.glob("*.npz") if p != path).read_bytes())
    load_or_compute(run_of(), WHAT, compute)
    assert len(settled) == 4  # that of another draw-in, under this name
