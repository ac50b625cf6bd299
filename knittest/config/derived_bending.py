"""Bending stiffness of the inlays in the plane of the shells, derived from the yarns of the fabric."""

from typing import get_args

from knittest.config.base import PerDirection, Quantity
from knittest.config.fabric import Direction, Fabric

#: the reference of a derived number begins with its formula and ends with the number
FORMULA = "EI of an inlay x inlays per width"


def derived_in_plane_bending(fabric: Fabric) -> PerDirection | None:
    """EI of an inlay times the inlays per width [N mm]; none where the fabric does not describe its inlays."""
    if fabric.reinforcing is None:
        return None
    found = {d: _derived(fabric, d) for d in get_args(Direction)}
    return PerDirection(warp=found["warp"], weft=found["weft"])


def is_derived(quantity: Quantity) -> bool:
    """Tell whether ``quantity`` was derived by this formula and not edited since."""
    told = quantity.ref.startswith(FORMULA) and quantity.ref.endswith(_shown(quantity.value))
    return quantity.source == "derived" and told


def follows_yarns(fabric: Fabric) -> bool:
    """Tell whether the bending in the plane of ``fabric`` is derived in any direction."""
    found = fabric.macro.in_plane_bending
    return found is not None and (is_derived(found.warp) or is_derived(found.weft))


def with_in_plane_bending(fabric: Fabric) -> Fabric:
    """``fabric`` with its stated bending in the plane, and a derived one where it states none.

    A number that was derived before is derived again: it follows a yarn or a density that has changed since.
    """
    stated, derived = fabric.macro.in_plane_bending, derived_in_plane_bending(fabric)
    if derived is None:
        return fabric
    kept = {} if stated is None else {d: stated.of(d) for d in get_args(Direction) if not is_derived(stated.of(d))}
    return _with(fabric, derived.model_copy(update=kept))


def without_in_plane_bending(fabric: Fabric) -> Fabric:
    """``fabric`` whose inlays do not bend in the plane of the shells."""
    return _with(fabric, None)


def _with(fabric: Fabric, bending: PerDirection | None) -> Fabric:
    macro = fabric.macro.model_copy(update={"in_plane_bending": bending})
    return fabric.model_copy(update={"macro": macro})


def _derived(fabric: Fabric, direction: Direction) -> Quantity:
    yarn = fabric.reinforcing.bending_stiffness.of(direction)
    density = fabric.warp_density if direction == "warp" else fabric.weft_density
    value = fabric.reinforcing.bending_stiffness_n_mm2.of(direction) * fabric.density_per_mm.of(direction)
    return Quantity(
        value=value,
        source="derived",
        ref=f"{FORMULA}: reinforcing.bending_stiffness.{direction} {yarn.value:g} N mm2 ({yarn.source}) x "
        f"{direction}_density {density.value:g} / 100 mm ({density.source}){_shown(value)}",
    )


def _shown(value: float) -> str:
    return f" = {value:.6g} N mm"
