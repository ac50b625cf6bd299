"""Origin of the results of forming."""

from typing import get_args

from knittest.config.derived_bending import is_derived
from knittest.config.fabric import Direction, Fabric
from knittest.experiment.friction_origin import assumed_friction
from knittest.experiment.origin import Origin, guessed
from knittest.laboratory.forming.config import FormingRun

DIRECTIONS: tuple[Direction, ...] = get_args(Direction)


class FormingOrigin(Origin[FormingRun]):
    """See :class:`knittest.experiment.origin.Origin`."""

    def assumed(self, run: FormingRun) -> tuple[str, ...]:
        """Assumed numbers of the fabric, also behind derived ones, and friction of the tools not measured for it."""
        return (*super().assumed(run), *_behind_derived(run.fabric), *assumed_friction(run))


def _behind_derived(fabric: Fabric) -> tuple[str, ...]:
    """Derived bending of the inlays in the plane whose EI or density is assumed."""
    bending, found = fabric.macro.in_plane_bending, []
    for direction in DIRECTIONS:
        fields = (f"reinforcing.bending_stiffness.{direction}", f"{direction}_density")
        if bending is not None and is_derived(bending.of(direction)) and (names := guessed(fabric, fields)):
            found.append(f"macro.in_plane_bending.{direction} (from {' and '.join(names)})")
    return tuple(found)
