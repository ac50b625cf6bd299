"""Meshes for Abaqus: types of elements, nodes and sets, as meshio reads them back."""

import meshio
import numpy as np
import pytest
from export_sample import beam_history, shell_history

from knittest.export.meshes import write_abaqus


@pytest.mark.parametrize(("make", "kind", "shape"), [(beam_history, "B31", "line"), (shell_history, "S4R", "quad")])
def test_a_mesh_is_read_back(tmp_path, make, kind, shape):
    """Not as axisymmetric elements, which meshio writes for any four corners."""
    history = make()
    mesh, position = history.mesh, history.frames[0].position
    write_abaqus(tmp_path / "a.inp", mesh, position)
    types = [line for line in (tmp_path / "a.inp").read_text().splitlines() if line.startswith("*ELEMENT")]
    assert types == [f"*ELEMENT, TYPE={kind}"]
    read = meshio.read(tmp_path / "a.inp", file_format="abaqus")
    assert np.array_equal(read.points, position) and np.array_equal(read.cells_dict[shape], mesh.cells)
    for number, name in enumerate(mesh.part_names):
        if (mesh.part == number).any():
            assert np.array_equal(np.sort(np.concatenate(read.cell_sets[name])), np.flatnonzero(mesh.part == number))
