"""The package in a notebook's kernel: progress in one line that is renewed, curves and views in cells."""

from pathlib import Path

import pytest

nbclient = pytest.importorskip("nbclient")
nbformat = pytest.importorskip("nbformat")
pytest.importorskip("ipykernel")

SWEEP = "base: {variant: 1, scale: macro, preset: quick, direction: warp}\ngrid: {rig.width: [25, 50]}\n"
CELLS = (
    "import knittest",
    'runs = knittest.tensile(fabric="2", scale="macro", preset="quick", out="runs", pictures=False)',
    "runs.plot()",
    "runs.show()",
    'knittest.batch("sweep.yaml", workers=1, out="sweep").passed',
)


@pytest.fixture(scope="module")
def outputs(tmp_path_factory):
    """Outputs of each cell."""
    folder = tmp_path_factory.mktemp("notebook")
    (folder / "sweep.yaml").write_text(SWEEP)
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS])
    nbclient.NotebookClient(book, timeout=120, resources={"metadata": {"path": str(folder)}}).execute()
    return [cell.outputs for cell in book.cells]


def test_progress_is_one_line(outputs):
    (told,) = outputs[1]
    assert told.output_type == "display_data" and told.data["text/plain"].startswith("weft: ")
    assert "done in" in told.data["text/plain"] and "\n" not in told.data["text/plain"]


def test_a_curve_is_drawn_in_its_cell(outputs):
    assert any("image/png" in output.get("data", {}) for output in outputs[2])


def test_views_of_both_directions_are_in_their_cell(outputs):
    (found,) = outputs[3]
    assert found.data["text/html"].count("<iframe srcdoc=") == 2 and "three.js" in found.data["text/html"]
    assert found.data["text/plain"].splitlines() == [
        f"3D view: {Path('runs', d, 'view.html')}" for d in ("warp", "weft")
    ]


def test_a_sweep_is_told_in_one_text(outputs):
    told, *_, passed = outputs[4]  # and between them where the report is
    assert passed.data["text/plain"] == "True"
    assert told.data["text/plain"].startswith("2/2 runs (2 completed)")
