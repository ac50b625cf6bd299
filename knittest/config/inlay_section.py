"""The sections of the inlays in contact, and how they flatten."""

from typing import ClassVar, Literal

from pydantic import Field

from knittest.config.base import PerDirection, Quantity, Strict, measure
from knittest.config.kernel_units import Kernel


class Flattening(Strict):
    """Lateral compaction of a section of conserved area: pressure = modulus x (share of height)^exponent.

    The pressure acts over the width; from the sides over the height, with the share of the width that is lost.
    """

    exponent: Literal[1, 3] = Field(1, description="power of the share by which the section is compacted")
    modulus: Quantity = measure("MPa", "modulus of the inlays across", gt=0, band=(0.1, 1e4))
    modulus_mpa: ClassVar[Kernel[float]] = Kernel("modulus")


class InlaySection(Strict):
    """Elliptic sections of the inlays in contact: pi / 4 x width x height = fibre area / packing.

    The fibre area is ``linear_density`` over ``fibre_density``. They start with their width in the plane of the fabric.
    """

    shape: Literal["ellipse"] = Field(description="shape of the section")
    fibre_density: Quantity = measure(
        "g/cm3", "mass of the yarn over the volume of its fibres, matrix fibres too", gt=0, band=(0.8, 9)
    )
    fibre_density_g_per_mm3: ClassVar[Kernel[float]] = Kernel("fibre_density")
    packing: PerDirection = measure("1", "fibre area over the area of the section", ge=0.3, le=0.907)
    width_to_height: PerDirection = measure("1", "width of the section over its height", ge=1, le=4)
    flattening: Flattening | None = Field(None, description="how sections flatten under lateral force; none: rigid")
