"""A shell without area says what took it: shear beyond its law, which no smaller step helps, or something else."""

from types import SimpleNamespace

import numpy as np
import pytest

from knittest.base.errors import NumericalError
from knittest.models import fabric_model
from knittest.models.fabric_model import FabricModel
from knittest.solve.guards import check_entities


@pytest.mark.parametrize(
    ("angle", "words"),
    [
        (-85.0, r"of its area, sheared by 85 deg at 7\.00000 ms; .*extend fabric\.macro"),
        (30.0, r"of its area at 7\.00000 ms; reduce solver\.safety or solver\.speed$"),
    ],
)
def test_the_remedy_is_that_of_the_cause(monkeypatch, angle, words):
    monkeypatch.setattr(fabric_model, "smallest_shell", lambda *_: (1, 0.04))
    shells = SimpleNamespace(conn=None, fail_time=None, state=None)
    model = SimpleNamespace(
        nodes=SimpleNamespace(position=None), shells=shells, tracker=None,
        fields=lambda: {"shear_angle": np.deg2rad([0.0, angle])},
    )  # fmt: skip
    model.invalid_state = lambda dt: FabricModel.invalid_state(model, dt)
    model.bends = SimpleNamespace(alive=np.zeros(0))
    model.diagnose = lambda dt: FabricModel.diagnose(model, dt)
    with pytest.raises(NumericalError, match="shell 1 has collapsed to 4.0 % " + words):
        check_entities(SimpleNamespace(model=model, dt=1e-3, time=7.0))
