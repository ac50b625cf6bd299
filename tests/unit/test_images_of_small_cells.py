"""A cell of thin yarns at close spacing holds all images that its yarns come near."""

import numpy as np
import pytest

from knittest.config.loading import resolve
from knittest.config.templates import new_fabric_text
from knittest.models.periodic_model import PeriodicModel, missing_image
from knittest.runs.specimen import prepare

THIN = ("fabric.warp_density=38", "fabric.weft_density=58.4", "fabric.loop_length=8.83")
YARNS = {"reinforcing": "E-glass 200 tex", "knitting": "polyester 50 tex"}


@pytest.fixture(scope="module")
def cell(tmp_path_factory: pytest.TempPathFactory) -> PeriodicModel:
    file = tmp_path_factory.mktemp("thin") / "thin.yaml"
    file.write_text(new_fabric_text("thin", resolve(variant="1").fabric, yarns=YARNS), encoding="utf-8")
    run = resolve(test="cell", fabric=file, preset="standard", sets=[*THIN, "rig.path=warp"])
    model = prepare(run).model
    assert isinstance(model, PeriodicModel)
    return model


def test_no_image_is_missing_at_the_start(cell: PeriodicModel) -> None:
    assert missing_image(cell) == ""


def test_a_missing_image_is_named(cell: PeriodicModel) -> None:
    """Yarns that moved by half a cell come near images that the cell has not."""
    kept = cell.nodes.position.copy()
    own = np.flatnonzero(cell.owned)
    cell.nodes.position[0, own[: len(own) // 2]] += 0.75 * cell.images.lattice[0]
    assert "approach each other where the cell has no image" in missing_image(cell)
    cell.nodes.position[:] = kept
