"""Frames as VTK itself reads them, which is what ParaView opens: points, cells, every field, and the collection."""

from pathlib import Path

import numpy as np
import pytest
from export_sample import beam_history, shell_history

from knittest.base.history import Frame, History
from knittest.export.meshes import tube_surface, write_frames, write_tubes

io = pytest.importorskip("vtkmodules.vtkIOXML", reason="needs vtk, from the extra viz")
xml = pytest.importorskip("vtkmodules.vtkIOXMLParser", reason="needs vtk, from the extra viz")
to_numpy = pytest.importorskip("vtkmodules.util.numpy_support", reason="needs vtk, from the extra viz").vtk_to_numpy

#: VTK_LINE and VTK_QUAD of vtkCellType.h
CELLS = {"beams": (beam_history, 3), "shells": (shell_history, 9)}


@pytest.fixture(params=CELLS)
def written(request, tmp_path) -> tuple[Path, History, int]:
    make, cell_type = CELLS[request.param]
    history = make()
    tiny = np.linspace(-1.0, 1.0, len(history.mesh.cells)) * 1e-300
    history.frames[1].fields["tiny"] = tiny
    history.frames[1].fields["not a number"] = np.where(tiny > 0.0, np.nan, np.inf)
    write_frames(tmp_path, history)
    return tmp_path, history, cell_type


def entries(folder: Path) -> list[tuple[float, Path]]:
    """Time and file of every frame that the collection lists."""
    root = xml.vtkXMLUtilities.ReadElementFromFile(str(folder / "frames.pvd"))
    assert (root.GetName(), root.GetAttribute("type")) == ("VTKFile", "Collection")
    found = root.FindNestedElementWithName("Collection")
    sets = [found.GetNestedElement(k) for k in range(found.GetNumberOfNestedElements())]
    return [(float(each.GetAttribute("timestep")), folder / each.GetAttribute("file")) for each in sets]


def read(path: Path):
    reader = io.vtkXMLUnstructuredGridReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.Update()
    assert reader.GetErrorCode() == 0
    return reader.GetOutput()


def arrays(data) -> dict[str, np.ndarray]:
    return {data.GetArrayName(k): to_numpy(data.GetArray(k)) for k in range(data.GetNumberOfArrays())}


def expected_cells(history: History, frame: Frame) -> dict[str, np.ndarray]:
    mesh = history.mesh
    return {"part": mesh.part, "yarn": mesh.yarn, "radius": mesh.radius, **frame.fields}


def test_collection_lists_every_frame_with_its_time(written):
    folder, history, _ = written
    listed = entries(folder)
    assert [time for time, _ in listed] == [frame.time for frame in history.frames]
    assert sorted(path for _, path in listed) == sorted((folder / "frames").iterdir())


def test_points_cells_and_fields_are_what_was_written(written):
    folder, history, cell_type = written
    for (_, path), frame in zip(entries(folder), history.frames, strict=True):
        grid = read(path)
        np.testing.assert_array_equal(to_numpy(grid.GetPoints().GetData()), frame.position)
        assert {grid.GetCellType(k) for k in range(grid.GetNumberOfCells())} == {cell_type}
        cells = to_numpy(grid.GetCells().GetConnectivityArray()).reshape(history.mesh.cells.shape)
        np.testing.assert_array_equal(cells, history.mesh.cells)
        fields, expected = arrays(grid.GetCellData()), expected_cells(history, frame)
        assert set(fields) == set(expected)
        for name, values in expected.items():
            np.testing.assert_array_equal(fields[name], values, err_msg=name)
        points = arrays(grid.GetPointData())
        assert set(points) == {"displacement"} | ({"radius"} if history.mesh.kind == "beams" else set())
        np.testing.assert_array_equal(points["displacement"], frame.position - history.frames[0].position)


def test_failed_elements_can_be_thresholded(written):
    folder, history, _ = written
    alive = arrays(read(entries(folder)[-1][1]).GetCellData())["alive"]
    assert np.array_equal(alive, history.frames[-1].fields["alive"])
    assert set(np.unique(alive)) == {0.0, 1.0}


def test_tubes_have_the_thickest_radius_of_their_beams(tmp_path):
    history = beam_history()
    write_frames(tmp_path, history)
    mesh = history.mesh
    radius = arrays(read(entries(tmp_path)[0][1]).GetPointData())["radius"]
    for node in np.unique(mesh.cells):
        assert radius[node] == mesh.radius[(mesh.cells == node).any(axis=1)].max()


@pytest.mark.parametrize("names", [("a---b", "c>", "<x&y>"), ("-", "--", "")])
def test_part_names_cannot_break_the_collection(tmp_path, names):
    history = shell_history()
    object.__setattr__(history.mesh, "part_names", names)
    write_frames(tmp_path, history)
    assert len(entries(tmp_path)) == len(history.frames)


def test_tubes_of_yarns_are_poly_data(tmp_path):
    made = tube_surface(np.array([[0.0, 0.0, k] for k in range(5)]), np.array([[k, k + 1] for k in range(4)]),
                        np.full(4, 0.5), np.ones(4, bool), 8)  # fmt: skip
    write_tubes(tmp_path / "yarn.vtp", made, {"axial_force": np.arange(4.0)})
    reader = io.vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "yarn.vtp"))
    reader.Update()
    found = reader.GetOutput()
    assert (found.GetNumberOfPoints(), found.GetNumberOfPolys()) == (len(made.points), len(made.triangles))
    assert np.allclose(to_numpy(found.GetPoints().GetData()), made.points)
    assert np.array_equal(to_numpy(found.GetCellData().GetArray("axial_force")), np.arange(4.0)[made.element])
