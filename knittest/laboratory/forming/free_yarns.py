"""Note on a blank of shells whose inlays do not bend in the plane."""

from knittest.laboratory.forming.config import FormingRun


def free_yarns(run: FormingRun) -> tuple[str, ...]:
    """A note on shells of ``run`` whose inlays do not bend in the plane; none on others, and none on yarns."""
    if run.model.scale == "meso" or run.fabric.macro.in_plane_bending is not None:
        return ()
    return (
        "inlays do not bend in the plane of the shells: a compressed flange folds into bands of shear one element "
        f"wide, and forces fall with the element size; {in_plane_bending(run)}",
    )


def in_plane_bending(run: FormingRun) -> str:
    """Settings of ``run`` that make the inlays bend in the plane: the switch, or numbers that cannot be derived."""
    if run.fabric.reinforcing is None:
        return (
            "the fabric describes no inlays to derive the stiffness from: give fabric.macro.in_plane_bending.warp and "
            ".weft [N mm], EI of an inlay x inlays per width"
        )
    return "use --set rig.in_plane_bending=true"
