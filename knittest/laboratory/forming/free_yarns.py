"""Yarns of a blank of shells that do not bend in the plane, and how stiff they would be."""

from knittest.config.fabric import YARN_LEVEL, Fabric
from knittest.laboratory.forming.config import FormingRun
from knittest.laboratory.forming.yarn_forces import DIRECTIONS


def free_yarns(run: FormingRun) -> tuple[str, ...]:
    """A note on shells of ``run`` whose yarns do not bend in the plane; none on others, and none on yarns."""
    if run.model.scale == "meso" or run.fabric.macro.in_plane_bending is not None:
        return ()
    return (
        "yarns of the shells do not bend in the plane: a compressed flange folds into bands as narrow as the shells, "
        f"and forces fall with their size; what holds them: {in_plane_bending(run.fabric)}",
    )


def in_plane_bending(fabric: Fabric) -> str:
    """Options that make the yarns of ``fabric`` bend in the plane, where they are described; else what to give."""
    if any(getattr(fabric, name) is None for name in YARN_LEVEL):
        return "fabric.macro.in_plane_bending, EI of a yarn over the distance of the yarns [N mm] (none are described)"
    yarn = fabric.reinforcing.bending_stiffness_n_mm2
    values = {d: fabric.density_per_mm.of(d) * yarn.of(d) for d in DIRECTIONS}
    return " ".join(f"--set fabric.macro.in_plane_bending.{d}={value:.3g}" for d, value in values.items())
