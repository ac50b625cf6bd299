"""The page of structures: the stored cells are those of the shipped files, and each structure has its pictures."""

import pytest
import yaml

from docs import generate_structures
from docs import structures as stored
from knittest.base.files import structures
from knittest.config.loading import resolve

PAGE = (stored.HERE / "structures.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", structures())
def test_a_stored_structure_has_the_inputs_of_its_file(name):
    found, fabric = stored.load()[name], resolve(variant=name).fabric
    assert not found.is_stale(fabric), f"run python -m docs.structures {name}, then python -m docs.generate"
    assert found.is_stale(fabric.model_copy(update={"stitches": ["kkkp"]}))
    for direction, curve in found.curves.items():
        strain = [one for one, _ in curve]
        assert strain == sorted(strain) and len(strain) > 10
        assert strain[-1] <= stored.settings_of(fabric, direction).get("rig.max_strain", 40.0) + 1e-6
    for picture in (f"{name}.png", f"{name}-curves.png"):
        assert (stored.PICTURES / picture).is_file() and f"(structures/{picture})" in PAGE


def test_the_page_shows_the_fields_of_the_files():
    for name, path in structures().items():
        shown, whole = yaml.safe_load(generate_structures._fields(name)), yaml.safe_load(path.read_text())
        assert shown == {key: value for key, value in whole.items() if key not in ("name", "title")}
        assert f"### {name}\n" in PAGE


def test_an_unknown_structure_is_named(capsys):
    assert stored.main(["ribb"]) == 2
    assert "ribb: no such structure; expected 0-90-0" in capsys.readouterr().out
