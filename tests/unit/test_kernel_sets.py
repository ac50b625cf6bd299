"""Kernels are compiled for what a run uses, and nothing else. No compiling."""

from pathlib import Path

import numpy as np
import pytest

from knittest import pose
from knittest.base.files import PACKAGE
from knittest.base.kinds import kinds
from knittest.config.loading import resolve
from knittest.config.run import Run
from knittest.kernels.state import ContactLaw
from knittest.solve.tiny_models import ALL, ELLIPSES, kernels_of

PATCH = [f"fabric.contact.patch.radius.{kind}=0.2" for kind in ("inlay_inlay", "inlay_loop", "loop_loop")]


def _run(test: str = "tensile", scale: str = "meso", *sets: str) -> Run:
    return resolve(test=test, variant="2", scale=scale, preset="quick", sets=list(sets))


@pytest.mark.parametrize(
    ("run", "needed"),
    [
        (_run(), "meso"),
        (_run("picture-frame"), "meso"),
        (_run("forming"), "meso-tools"),
        (_run("compaction"), "meso-tools"),
        (_run("cell"), "meso-periodic"),
        (_run("tensile", "meso", *PATCH), "meso-spin"),
        (_run("cell", "meso", *PATCH), "meso-spin-periodic"),
        (_run("tensile", "meso", *ELLIPSES), "meso-oval"),
        (_run("tensile", "macro"), "macro"),
        (_run("friction", "macro"), "macro-tools"),
        (_run("forming", "macro", "model.macro.self_contact=true"), "macro-contact-tools"),
    ],
)
def test_kernels_are_compiled_for_what_a_run_uses(run: Run, needed: str) -> None:
    assert kernels_of(run) == (needed,)
    assert kernels_of(run, 2) == (needed, f"{needed}-threads")


def test_a_fabric_that_settles_needs_those_of_its_cell_first() -> None:
    assert kernels_of(_run("tensile", "meso", "fabric.knitting.loop_shortening=0.2")) == ("meso-periodic", "meso")


@pytest.mark.parametrize("name", sorted(kinds()))
def test_the_record_of_a_test_says_whether_tools_touch_its_specimen(name: str) -> None:
    kind = kinds()[name]
    if kind.periodic:
        return  # compiled with tools whether its path has any or not
    folder = PACKAGE / "laboratory" / Path(kind.run.split(":")[0].replace(".", "/")).parent.name
    adds = any("add_tool(" in source.read_text() for source in folder.glob("*.py"))
    assert kind.tools == adds


@pytest.mark.parametrize("name", sorted(kinds()))
def test_warmup_compiles_what_shipped_fabrics_need(name: str) -> None:
    for scale in kinds()[name].scales:
        assert kernels_of(_run(name, scale))[0] in ALL[scale]


def test_without_tools_the_step_is_compiled_for_none() -> None:
    chain = pose.Chain(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), pose.round_section(1e3, 0.5, 1e-3))
    body = pose.Body.of_chains([chain])
    assert body.model.kernel_drive(body.start().drive)[3:] == (None, None)
    touched = pose.Body.of_chains([chain])
    touched.boundary.add_tool(pose.plane((0.0, 0.0, -1.0), (0.0, 0.0, 1.0)))
    drive = touched.start().drive
    assert touched.model.kernel_drive(drive)[3:] == (drive.tools, drive.touch)


def test_what_resists_spin_is_compiled_for_laws_that_have_it() -> None:
    assert ContactLaw(1.0, 1.0, 0.1, 0.1, 0.0).spin is None
    assert ContactLaw(1.0, 1.0, 0.1, 0.1, 0.0, torsional=1e-3).spin
