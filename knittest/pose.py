"""Pose anything the kernel solves by hand: the public Python interface.

Units everywhere: mm, ms, g, N, MPa (so mJ, N mm, mm/ms = m/s, N/mm). A cantilever of 10 mm under an end force of
0.5 N bends by F L^3 / (3 E I) = 0.179 mm:

    >>> import numpy as np
    >>> from knittest.pose import ALL, Body, Chain, ramp, round_section
    >>> points = np.column_stack([np.linspace(0.0, 10.0, 21), np.zeros(21), np.zeros(21)])
    >>> body = Body.of_chains([Chain(points, round_section(modulus=60e3, diameter=0.75, density=2.5e-3))])
    >>> held = [body.boundary.move([0], dof) for dof in ALL]
    >>> body.boundary.load([20], "z", 0.5, ramp(1.0, 1.0))
    >>> relaxation = body.relax()
    >>> print(f"{body.position[20, 2]:.3f} mm, {body.reaction(held[2]):.2f} N, {body.reaction(held[4]):.2f} N mm")
    0.179 mm, -0.50 N, 5.00 N mm

``body.boundary`` takes supports and motions of single degrees of freedom in global axes or one's own (an inclined
roller, a symmetry plane at an angle), point loads, moments that keep their direction, gravity and rigid tools
(:func:`plane`, :func:`plate`, :func:`cylinder`, :func:`surface`; held, moved or loaded). The rigs of the laboratory are
posed through the same class. Chains have one bending stiffness or two (:func:`strip_section`); shells may contract
across a pull (``poisson`` of :func:`linear_laminate`). A :class:`PeriodicBody` is one cell of yarns, of a fabric
without an edge.
"""

from knittest.kernels.shell_state import Laminate
from knittest.materials.yarn_section import Patch, Section
from knittest.models.boundary import ALL, Boundary, Readings
from knittest.models.chains import Chain
from knittest.models.crossings import Crossings
from knittest.models.periodic import PeriodicChain
from knittest.models.sections import linear_laminate, round_section, section, strip_section
from knittest.models.sheet_tracker import SheetContact
from knittest.models.surface import read_surface, surface
from knittest.models.tool import Table, Tool, constant, cylinder, plane, plate, ramp, sampled
from knittest.models.yarn_contact import YarnContact
from knittest.solve.body import Body
from knittest.solve.periodic_body import PeriodicBody
from knittest.solve.relaxation import Relaxation

__all__ = [
    "ALL", "Body", "Boundary", "Chain", "Crossings", "Laminate", "Patch", "PeriodicBody", "PeriodicChain", "Readings",
    "Relaxation", "Section", "SheetContact", "Table", "Tool", "YarnContact",
    "constant", "cylinder", "linear_laminate", "plane", "plate", "ramp",
    "read_surface", "round_section", "sampled",
    "section", "strip_section", "surface",
]  # fmt: skip
