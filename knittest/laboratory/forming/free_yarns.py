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
        f"and forces fall with their size; fabric.macro.in_plane_bending holds them: {in_plane_stiffness(run.fabric)}",
    )


def in_plane_stiffness(fabric: Fabric) -> str:
    """Values of ``fabric.macro.in_plane_bending`` [N mm] where the yarns are described, else what to give."""
    if any(getattr(fabric, name) is None for name in YARN_LEVEL):
        return "EI of a yarn over the distance of the yarns [N mm] (no yarns are described)"
    yarn = fabric.reinforcing.bending_stiffness_n_mm2
    each = [f"{d} {fabric.density_per_mm.of(d) * yarn.of(d):.3g}" for d in DIRECTIONS]
    return f"{' and '.join(each)} N mm by EI of the yarns over their distance"
