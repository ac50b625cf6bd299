"""Stamp below the pictures of a run: fabric, test, size, forces, and whether its gates passed."""

from collections.abc import Sequence

from knittest.base.kinds import kinds
from knittest.base.stamp import Stamp
from knittest.config.deciding import deciding
from knittest.config.looser import loosened
from knittest.config.run import Run
from knittest.config.sources import numbers_of
from knittest.experiment.borrowed import borrowed
from knittest.experiment.friction_origin import assumed_friction

SCALES = {"macro": "shells (macro)", "meso": "yarns (meso)"}


def run_stamp(run: Run, failures: Sequence[str]) -> Stamp:
    """Stamp of the pictures of ``run``, whose gates refused it for ``failures`` or passed."""
    test = " ".join(filter(None, (run.rig.kind, run.direction)))
    many = f"{run.variability.specimens} specimens" if run.variability.specimens > 1 else ""
    seed = f"seed {run.variability.seed}"
    facts = (
        run.fabric.name, f"parameters {numbers_of(run.parameters)}", test, SCALES[run.model.scale],
        f"preset {run.model.preset}", *size_of(run), many, seed,
    )  # fmt: skip
    verdict = f"comparison refused: {'; '.join(failures)}" if failures else "gates passed"
    accepted = [one.stated for one in loosened(run)]
    looser = f", with accepted limits: {'; '.join(accepted)}" if accepted and run.accept_limits else ""
    return Stamp(facts, f"{verdict}{looser}{_taken_over(run)}", bad=bool(failures or looser))


def size_of(run: Run) -> tuple[str, ...]:
    """Size of the specimen and the forces on it, in words; nothing of a test that does not state it."""
    kind = kinds()[run.rig.kind]
    return tuple(kind.load("size")(run)) if kind.size else ()


def _taken_over(run: Run) -> str:
    """Curves of another fabric that decide the test, and friction that was not measured for it."""
    owners = borrowed(run.fabric)
    found = [f"{field} of {owners[field]}" for field in deciding(run) if field in owners]
    found += assumed_friction(run)
    return f"; assumed: {', '.join(found)}" if found else ""
