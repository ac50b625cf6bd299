"""Homogenisations whose yarns, and where wanted whose shells, are formulas instead of simulations."""

import json
from pathlib import Path

import numpy as np

from knittest.config.fabric import CARD
from knittest.config.loading import resolve
from knittest.materials.heavy_elastica import chord_angle
from knittest.studies.homogenise import command
from knittest.studies.homogenise.command import HomogeniseOptions, run_homogenisation
from knittest.studies.homogenise.plan import Request, overhang, width
from knittest.studies.trials.trial import Record

OUT = Path("h")
#: what a yarn of a strip carries at its fracture strain [%], and the bending stiffness of the strip [N mm]
YARN_FORCE, STRAIN = 400.0, {"warp": 1.6, "weft": 1.8}
BENDING = {"warp": 6.0, "weft": 4.0}


def pull(strain, last: float):
    """Force of a yarn [N]: softer at first, as of a wavy one."""
    share = strain / last
    return YARN_FORCE * (0.25 * share + 0.75 * share**2.5)


def shear(angle):
    """Conjugate shear force [N/mm] at an angle [deg]."""
    return 8e-4 * angle + 3e-7 * angle**3


def coupled(strain):
    """Forces per width [N/mm] at both ``strain`` (n, 2) of W = e K e / 2 + 1e7 s^4, s = e_warp + e_weft / 2."""
    cubic = 4e7 * (strain @ np.array([1.0, 0.5])) ** 3
    return strain @ np.array([[4000.0, 1500.0], [1500.0, 3000.0]]) + np.column_stack([cubic, 0.5 * cubic])


def _write(folder: Path, columns: dict) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    rows = "\n".join(",".join(f"{v:.10g}" for v in row) for row in zip(*columns.values(), strict=True))
    (folder / "curve.csv").write_text(f"{','.join(columns)}\n{rows}\n")


def formula(trial, folder: Path, factor: float = 1.0) -> dict[str, float]:
    """Results of a test of yarns, whose curve goes to ``folder``."""
    run = trial.run
    if run.rig.kind == "cell":
        return _of_cell(run, folder)
    if run.rig.kind == "cantilever":
        weight = run.fabric.area_mass_g_per_mm2 * run.rig.gravity_mm_per_ms2
        return {"chord_angle_deg": chord_angle(overhang(run), weight, factor * BENDING[run.direction])}
    if run.rig.kind == "biaxial":
        own = np.linspace(0.0, 0.01 * run.rig.max_strain / max(1.0, run.rig.ratio), 300)
        both = [own, run.rig.ratio * own]
        if run.rig.direction == "weft":
            both.reverse()
        forces = factor * coupled(np.column_stack(both))
        names = ("force_n_per_mm", "cross_force_n_per_mm")
        by_name = dict(zip(names if run.rig.direction == "warp" else names[::-1], forces.T, strict=True))
        _write(folder, {"strain_pct": 100.0 * own} | by_name)
        return {"biaxial_force_n_per_mm": float(forces.max())}
    if run.rig.kind == "tensile":
        last = STRAIN[run.direction]
        number = width(run) * run.fabric.density_per_mm.of(run.direction)
        strain = np.linspace(0.0, 1.5 * last, 600)
        force = factor * number * np.where(strain <= last, pull(strain, last), 0.1 * YARN_FORCE)
        _write(folder, {"strain_pct": strain, "force_n": force})
        top = int(np.argmax(force))
        return {"peak_force_n": float(force[top]), "fracture_strain_pct": float(strain[top])}
    angle = np.linspace(0.0, run.rig.max_angle, 500)
    normalised = factor * shear(angle) / np.cos(np.deg2rad(angle))
    _write(folder, {"frame_shear_angle_deg": angle, "normalised_shear_force_n_per_mm": normalised})
    return {"shear_force_n_at_deg.10": 1.0}


def _of_cell(run, folder: Path) -> dict[str, float]:
    """Results of a path of a cell of the same material; its yarns are torn if the path goes so far."""
    rig = run.rig
    if rig.path == "bending":
        return {"cell_bending_stiffness_n_mm": BENDING[rig.bent_yarns]}
    if rig.path == "shear":
        angle = np.linspace(0.0, rig.max_angle, 500)
        _write(folder, {"shear_angle_deg": angle, "conjugate_force": shear(angle)})
        return {"cell_shear_n_per_mm_at_deg.10": shear(10.0)}
    if rig.path == "steps":  # torn at the end
        share = np.linspace(0.0, 0.97, 300)
        _, weft, _, _, warp = np.array(rig.steps[-1]) - 1.0
        forces = coupled(share[:, None] * np.array([warp, weft]))
        _write(folder, {"path_pct": 100.0 * share, "warp_n_per_mm": forces[:, 0], "weft_n_per_mm": forces[:, 1]})
        return {"cell_warp_n_per_mm": float(forces[-1, 0])}
    last = STRAIN[rig.path]
    strain = np.linspace(0.0, min(last, rig.max_strain), 600)
    force = run.fabric.density_per_mm.of(rig.path) * pull(strain, last)
    _write(folder, {"strain_pct": strain, f"{rig.path}_n_per_mm": force})
    return {"cell_fracture_strain_pct": last} if rig.max_strain >= last else {}


class Formulas:
    """A pool whose trials are :func:`formula`; those of shells ``factor`` times as stiff, or run by ``shells``.

    ``ends`` says how a trial ends.
    """

    def __init__(self, ends=lambda trial: "completed", factor: float = 1.0, shells=None):
        self.asked: list[str] = []
        self._ends, self._factor, self._shells = ends, factor, shells

    def run(self, trials, place, limit, options, watch):
        real = [trial for trial in trials if self._shells and trial.run.model.scale == "macro"]
        for trial in trials:
            self.asked.append(trial.label)
            if trial in real:
                continue
            status = self._ends(trial)
            if status != "completed":
                yield Record(trial.key, status, f"{status} on purpose", limit=limit)
                continue
            factor = self._factor if trial.run.model.scale == "macro" else 1.0
            results = formula(trial, place(trial), factor)
            summary = {"results": results, "comparison": [], "refused": [], "quality": {}, "cost": {}}
            yield Record(trial.key, "completed", summary=summary)
        if real:
            yield from self._shells.run(real, place, limit, options, watch)

    def close(self):
        if self._shells:
            self._shells.close()


def homogenise(folder: Path, monkeypatch, pool, request: Request | None = None, picture: bool = False) -> int:
    """Exit code of a homogenisation in ``folder``/h."""
    monkeypatch.chdir(folder)
    monkeypatch.setattr(command, "LocalPool", lambda workers, threads: pool)
    if not picture:
        monkeypatch.setattr(command, "homogenise_picture", lambda *arguments: None)
    options = HomogeniseOptions(out=OUT, quiet=True)
    request = request or Request(variant="2", preset="quick")
    return run_homogenisation(request, options, "knittest homogenise ...").exit_code


def outcome(folder: Path) -> dict:
    """homogenise.json."""
    return json.loads((folder / OUT / "homogenise.json").read_text())


def with_shipped_card(run):
    """``run`` with the parts of variant 1's material card that its fabric leaves out, in place of derived ones."""
    fabric, shipped = run.fabric, resolve(variant="1").fabric.macro
    names = [name for name in (*CARD, "fracture_strain") if getattr(fabric.macro, name) is None]
    macro = fabric.macro.model_copy(update={name: getattr(shipped, name) for name in names})
    return run.model_copy(update={"fabric": fabric.model_copy(update={"macro": macro})})
