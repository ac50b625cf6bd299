"""Messages to the user about compilation."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from knittest.config.loading import resolve
from knittest.runs.preflight.model import model_facts, model_lines
from knittest.runs.specimen import prepare
from knittest.solve import warmup


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Messages on warming the macro kernels, without compiling anything."""
    monkeypatch.setattr(warmup, "CODE_FOLDER", tmp_path)
    for name in ("_exercise", "_compile_apart"):
        monkeypatch.setattr(warmup, name, lambda _: None)

    def say() -> str:
        monkeypatch.setattr(warmup, "_warm", set())
        phases: list[str] = []
        warmup.warm(resolve(variant="1", scale="macro"), SimpleNamespace(phase=phases.append))
        return phases[0]

    return say


def test_compilation_is_called_so_on_every_scale_and_processor(said, monkeypatch: pytest.MonkeyPatch) -> None:
    assert said() == "compiling the macro kernels (once per installation)"
    warmup.fill_cache("meso")
    assert said().startswith("compiling")
    warmup.fill_cache("macro")
    assert said() == "loading the macro kernels"
    monkeypatch.setattr("llvmlite.binding.get_host_cpu_name", lambda: "another")  # Numba compiles anew for it
    assert said().startswith("compiling")


def test_preflight_says_where_the_area_mass_comes_from() -> None:
    run = resolve(variant="1", scale="macro", preset="quick", sets=["fabric.area_mass=800"])
    assert any("(user 800 g/m2)" in line for line in model_lines(run, model_facts(run, prepare(run))))


def test_nothing_is_cached_without_a_folder(said, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(warmup, "CODE_FOLDER", None)
    monkeypatch.setattr(warmup, "_compile_apart", lambda _: pytest.fail("there is no folder to compile into"))
    warmup.fill_cache("macro")
    assert said() == "compiling the macro kernels (nothing is cached)"
