"""Files as testing machines write them: the right numbers, or the reason why not, for each kind of them."""

import pytest
from machine_exports import PEAK, REJECTED, RIGHT, SIZES, STRAIN

from knittest.base.errors import InputError
from knittest.experiment.lab_given import Given
from knittest.experiment.lab_strips import read_strips
from knittest.experiment.statistics import peaks

NOISY = {"rows at rest with noise": 0.02, "noise in the travel": 0.02}


@pytest.mark.parametrize("kind", RIGHT)
def test_maximum_force_and_strain_are_right(tmp_path, kind):
    export = RIGHT[kind]()
    said = dict(export.said or {})
    more = {name: said.pop(name) for name in ("columns", "named") if name in said}
    specimens = read_strips(export.written(tmp_path), Given(sizes=said, **more))
    force, strain = peaks(specimens)
    assert force == pytest.approx([PEAK], rel=1e-3)
    assert strain == pytest.approx([STRAIN], rel=NOISY.get(kind, 1e-3))
    assert specimens[0].width in (50.0, said.get("strip_width_mm"))


@pytest.mark.parametrize("kind", REJECTED)
def test_what_is_no_pull_is_rejected_with_its_name(tmp_path, kind):
    export, words = REJECTED[kind]
    path = export().written(tmp_path)
    with pytest.raises(InputError, match=words) as refused:
        peaks(read_strips(path, Given(sizes=SIZES)))
    assert str(refused.value).startswith(str(path))
