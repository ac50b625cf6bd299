"""``knittest fabric``: what it prints and writes, and that asking for help loads nothing heavy."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import meshio
import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner, Result
from fabric_cases import biaxial
from matplotlib.image import imread

from knittest.base.errors import InputError
from knittest.cli.fabric import fabric
from knittest.config.loading import resolve
from knittest.fabric.cell import CellSpec
from knittest.fabric.relaxation import relax_cell


@pytest.fixture(scope="module", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("KNITTEST_CACHE_DIR", str(tmp_path_factory.mktemp("cache")))
        patch.setattr("knittest.fabric.relaxation._cells_in_memory", {})  # cells of tests before these
        yield


def run(*arguments: str) -> Result:
    return CliRunner().invoke(fabric, arguments)


def test_relax_prints_the_cell_and_keeps_it() -> None:
    first, second = run("relax", "--variant", "1"), run("relax", "--variant", "1")
    assert first.exit_code == second.exit_code == 0
    rows = {line[:22].strip(): line[22:] for line in second.stdout.splitlines()}
    assert rows["fabric"] == "pham2019-v1"
    assert 2.0 < float(rows["thickness"].split()[0]) < 2.4
    assert "measured 2.22 ± 0.08 mm" in rows["thickness"]
    assert rows["Munden's Kc, Ks"].startswith("4.03, 16.3 (relaxed")  # 14.4 / 3.571, and 14.4 / 3.571 of that
    assert rows["time"] == "from the cache"
    assert Path(rows["stored in"]).is_file()
    assert "relaxing geometry" in first.stderr and not second.stderr


def test_a_loop_too_short_is_named() -> None:
    result = run("relax", "--variant", "1", "--set", "fabric.loop_length=13")
    assert isinstance(result.exception, InputError)
    message = str(result.exception)
    assert "fabric.loop_length = 13 mm is too short" in message
    shortest = float(re.findall(r"a longer loop, such as ([\d.]+) mm", message)[0])
    assert run("relax", "--variant", "1", "--set", f"fabric.loop_length={shortest}").exit_code == 0
    locked = run("relax", "--variant", "1", "--set", f"fabric.loop_length={0.97 * shortest:.3f}")
    assert "is too short" in str(locked.exception)


#: stiff thick loops of aramid at narrow spacing: wales and courses, inlays and loops [mm]
STIFF = biaxial(
    1.9455, 2.0747, 9.7, crimp=0.006, bending=(28.88, 28.88), bending_knit=4.141, diameter=0.598, knit_diameter=0.4477
)


@pytest.mark.parametrize("length", [9.7, 10.47])
def test_stiff_loops_at_narrow_spacing_relax(length: float) -> None:
    """The first one by penalties beyond 3200 N/mm, the second although closest points keep jumping."""
    cell = relax_cell(replace(STIFF, loop_length=length))
    assert cell.deepest < 5e-3 and cell.loop_length == pytest.approx(length, rel=1e-3)


def test_yarns_that_no_loop_fits() -> None:
    """Inlays as thick as the wales and courses leave no room for any loop."""
    run = resolve(variant="1", scale="meso", preset="quick", test="picture-frame")
    spec = CellSpec.of(run.fabric)
    spec = replace(spec, layers=tuple(replace(one, width=5.5, height=5.5) for one in spec.layers))
    with pytest.raises(InputError, match=r"loops up to 1\.7 times as long lock too; expected thinner"):
        relax_cell(spec)


def test_show_draws_all_yarn_systems(tmp_path: Path) -> None:
    out = tmp_path / "v2.png"
    assert run("show", "--variant", "2", "--out", str(out)).exit_code == 0
    image = imread(out)[..., :3]
    red, green, blue = image[..., 0], image[..., 1], image[..., 2]
    shares = [((blue > red + 0.2).mean()), ((red > blue + 0.2).mean()), ((image.max(axis=2) < 0.45).mean())]
    assert min(shares) > 0.03, "weft, loops or warp are missing"
    assert green.std() > 0.1


def test_export_vtu_and_csv_hold_the_same_points(tmp_path: Path) -> None:
    for name in ("c.vtu", "c.csv"):
        assert run("export", "--variant", "1", str(tmp_path / name), "--wales", "3", "--courses", "2").exit_code == 0
    table, mesh = pd.read_csv(tmp_path / "c.csv"), meshio.read(tmp_path / "c.vtu")
    np.testing.assert_allclose(mesh.points, table[["x_mm", "y_mm", "z_mm"]], atol=1e-6)
    yarns = table.groupby(["system", "yarn"]).size()
    assert yarns["warp"].size == 3 and yarns["weft"].size == 2 and yarns["knit"].size == 2
    cells = mesh.cells_dict["line"]
    assert len(cells) == len(table) - len(yarns)
    assert np.linalg.norm(mesh.points[cells[:, 1]] - mesh.points[cells[:, 0]], axis=1).max() < 0.3
    assert set(mesh.point_data["radius"]) == {0.25, 0.375}


def test_an_unknown_suffix_is_refused(tmp_path: Path) -> None:
    result = run("export", "--variant", "1", str(tmp_path / "loops.obj"))
    assert isinstance(result.exception, InputError)
    assert ".vtu or .csv" in str(result.exception)


def test_help_loads_nothing_heavy() -> None:
    heavy = "{'numba', 'numpy', 'pydantic', 'matplotlib', 'pandas'}"
    code = f"import sys, knittest.cli.fabric; print({heavy} & set(sys.modules))"
    assert (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.strip()
        == "set()"
    )
