"""Messages to the user about compilation."""

from contextlib import contextmanager, nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

from knittest.config.loading import resolve
from knittest.kernels import explicit
from knittest.runs.preflight.model import model_facts, model_lines
from knittest.runs.specimen import prepare
from knittest.solve import compilation, tiny_models


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Messages on warming the macro kernels on so many threads, and what is compiled, without compiling anything."""
    compiled: list[str] = []
    monkeypatch.setattr(compilation, "CODE_FOLDER", tmp_path)
    monkeypatch.setattr(compilation, "CODE_FOLDER", tmp_path)
    monkeypatch.setattr(compilation, "TinyModel", lambda _: SimpleNamespace(run_all=lambda: None))
    monkeypatch.setattr(compilation, "compile_in_background", lambda *kernels: nullcontext(compiled.extend(kernels)))

    def say(threads: int = 1) -> tuple[str, list[str]]:
        monkeypatch.setattr(compilation, "_warm", set())
        compiled.clear()
        phases: list[str] = []
        compilation.load_kernels(resolve(variant="1", scale="macro"), SimpleNamespace(phase=phases.append), threads)
        return phases[0], list(compiled)

    return say


def _complete(kernels: str) -> None:
    """Marker that a process leaves which compiled ``kernels``."""
    marker = compilation._marker(kernels)
    assert marker is not None
    marker.touch()


def test_compilation_is_called_so_on_every_scale_and_processor(said, monkeypatch: pytest.MonkeyPatch) -> None:
    assert said() == ("compiling the macro kernels (once for this kind of test)", ["macro"])
    _complete("meso")
    assert said()[0].startswith("compiling")
    _complete("macro")
    assert said() == ("loading the macro kernels", [])
    monkeypatch.setattr("llvmlite.binding.get_host_cpu_name", lambda: "another")  # Numba compiles anew for it
    assert said()[0].startswith("compiling")


def test_kernels_of_several_threads_are_compiled_for_runs_of_several(said) -> None:
    assert said(2)[1] == ["macro", "macro-threads"]
    _complete("macro")
    assert said(1)[1] == []
    assert said(2)[1] == ["macro-threads"]


def test_a_process_compiles_while_the_run_prepares_and_is_ended_with_it(said, monkeypatch) -> None:
    under_way: list[str] = []

    @contextmanager
    def process(*kernels: str):
        under_way.extend(kernels)
        yield
        under_way.clear()

    monkeypatch.setattr(compilation, "compile_in_background", process)
    monkeypatch.setattr(compilation, "_warm", set())
    run = resolve(variant="1", scale="meso")
    with compilation.compile_run_in_background(run):
        assert under_way == ["meso"]
    assert under_way == []
    _complete("meso")
    with compilation.compile_run_in_background(run):
        assert under_way == []


def test_preflight_says_where_the_area_mass_comes_from() -> None:
    run = resolve(variant="1", scale="macro", preset="quick", sets=["fabric.area_mass=800"])
    assert any("(user 800 g/m2)" in line for line in model_lines(run, model_facts(run, prepare(run))))


def test_preflight_states_the_loop_shortening_with_its_unit() -> None:
    sets = ["rig.width=20", "rig.gauge_length=20", "fabric.knitting.loop_shortening=1"]
    run = resolve(variant="1", scale="meso", preset="quick", direction="warp", sets=sets)
    specimen = model_lines(run, model_facts(run, prepare(run)))[1]
    assert specimen.endswith("loop shortening 1 %") and ", width 17.8571 mm, gauge 21.4286 mm, area " in specimen


def test_nothing_is_cached_without_a_folder(said, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (compilation, compilation):
        monkeypatch.setattr(module, "CODE_FOLDER", None)
    assert said() == ("compiling the macro kernels (no cache)", [])
    with compilation.compile_run_in_background(resolve(variant="1", scale="macro")):
        pass
    assert said()[1] == []


@pytest.mark.parametrize("kernels", ["meso", "macro"])
def test_stages_that_compile_side_by_side_call_the_step_they_are_for(kernels: str) -> None:
    stages = tiny_models.TinyModel(kernels)
    for stage in (stages.elements, stages.nodes, stages.run_between_steps, stages.step):
        stage()
    entry = explicit.advance_yarns_alone if kernels == "meso" else explicit.advance_fabric_alone
    assert entry.signatures
