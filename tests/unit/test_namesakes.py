"""A file of a user's own and a shipped one of the same name are never taken for each other in silence."""

import shutil
from pathlib import Path

import pytest

from knittest.base.errors import InputError
from knittest.base.files import configs_dir, data_dir
from knittest.config.loading import resolve
from knittest.config.yaml_writer import dump

CURVE = "pham2019/curves/tensile-v1-warp.csv"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def own_copy(folder: Path, change: str = "") -> Path:
    copy = folder / CURVE
    copy.parent.mkdir(parents=True)
    shutil.copyfile(data_dir() / CURVE, copy)
    copy.write_text(copy.read_text() + change)
    return copy


def curve_of(**more) -> str:
    run = resolve(scale="macro", direction="warp", **({"variant": "1"} | more))
    return run.fabric.macro.tension["warp"]


@pytest.mark.parametrize("root", ["data", "."])
def test_a_different_curve_of_that_name_is_refused_with_both(here, root):
    copy = own_copy(here / root, "3.0,120.0\n")
    with pytest.raises(InputError, match=r"fabric\.macro\.tension\.warp = 'pham.*rename yours.*absolute path") as error:
        curve_of()
    assert f"{copy.resolve()} and the shipped {data_dir() / CURVE}: " in str(error.value)


def test_the_same_curve_is_the_shipped_one(here):
    own_copy(here / "data")
    assert curve_of() == CURVE


def test_a_whole_path_says_which_and_stays_whole_in_the_config_of_the_run(here):
    copy = own_copy(here / "data", "3.0,120.0\n")
    rest = [f"fabric.macro.tension.weft={data_dir()}/pham2019/curves/tensile-v1-weft.csv", "fabric.experiment=null"]
    rest.append("fabric.experiment_variant=null")
    for path in (copy.resolve(), data_dir().resolve() / CURVE):
        run = resolve(variant="1", scale="macro", sets=[f"fabric.macro.tension.warp={path}", *rest])
        assert run.fabric.macro.tension["warp"] == str(path)
        (here / "config.yaml").write_text(dump(run))
        assert resolve(config=here / "config.yaml").fabric.macro.tension == run.fabric.macro.tension


def test_an_experiment_of_the_name_with_other_tables_is_refused(here):
    shutil.copytree(data_dir() / "pham2019", here / "data" / "pham2019")
    (here / "data" / "pham2019" / "SOURCE.md").write_text("mine")
    assert resolve(variant="1", scale="meso").fabric.experiment == "pham2019"
    table = here / "data" / "pham2019" / "table3-fabric-tests.csv"
    table.write_text(table.read_text().replace("5744", "5745"))
    with pytest.raises(InputError, match=r"fabric\.experiment = 'pham2019': found two different files"):
        resolve(variant="1", scale="meso")


@pytest.mark.parametrize("folder", ["configs", "configs/fabrics"])
def test_a_different_fabric_of_the_name_is_refused_but_not_that_of_the_number(here, folder):
    (here / folder).mkdir(parents=True)
    copy = here / folder / "pham2019-v1.yaml"
    shutil.copyfile(configs_dir() / "fabrics" / "pham2019-v1.yaml", copy)
    resolve(variant="pham2019-v1")
    copy.write_text(copy.read_text().replace("14.4", "14.5"))
    with pytest.raises(InputError, match=r"--variant pham2019-v1: found two different fabrics, .*pham2019-v1\.yaml"):
        resolve(variant="pham2019-v1")
    assert resolve(variant="1").fabric.loop_length.value == 14.4
    assert resolve(fabric=copy).fabric.loop_length.value == 14.5
