"""A periodic cell of yarns posed by hand: mean deformations and stresses, energies by mechanism, crossings."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike

from knittest.base.arrays import Array
from knittest.base.errors import InputError
from knittest.kernels.threading import limit_threads
from knittest.models.crossings import Crossings, crossings, surfaces
from knittest.models.inputs import finite_array
from knittest.models.periodic import PeriodicChain, build_periodic
from knittest.models.periodic_model import NUMBERS, PeriodicModel
from knittest.models.tool import Table, constant
from knittest.models.yarn_contact import YarnContact
from knittest.solve.body import Body
from knittest.solve.relaxation import Relaxation, relax_held
from knittest.solve.state import ModelStepper


class PeriodicBody(Body):
    """One cell of a fabric without an edge: its yarns go on in images of the cell, and touch them.

    The mean deformation is imposed through the lattice, by :meth:`stretch` and :meth:`bend`, exactly; what is neither
    moved nor :meth:`free` is held. All else is as in :class:`Body`: damping, loads and tools act on the nodes of the
    cell, ``energies`` are the cell's, their ``external`` with the work of the mean deformation.
    """

    @classmethod
    def of_cell(
        cls,
        chains: Sequence[PeriodicChain],
        lattice: ArrayLike,
        contact: YarnContact | None = None,
        part_names: tuple[str, ...] = ("yarn",),
        halo: float | None = None,
        **options: Any,
    ) -> "PeriodicBody":
        """Cell of ``chains`` that repeats by the vectors ``lattice`` (2, 3) [mm]; see :func:`build_periodic`."""
        if not chains:
            raise InputError("chains: expected at least one")
        return cls(build_periodic(chains, lattice, part_names, contact, halo=halo), **options)

    @property
    def cell(self) -> PeriodicModel:
        """The model."""
        return cast(PeriodicModel, self.model)

    def stretch(self, rate: ArrayLike, table: Table) -> None:
        """Deform the mean: the gradient F (3, 3) grows by ``rate`` (3, 3) times ``table`` [1/ms] in global axes."""
        vectors = finite_array(rate, "rate of the mean gradient", (3, 3)) @ self.cell.reference.T
        for name, value in zip(NUMBERS, vectors.T.ravel(), strict=False):
            if value != 0.0:
                scaled = Table(table.time, tuple(value * v for v in table.value))
                self.cell.drive(self.boundary, name, scaled)

    def bend(self, table: Table, along: ArrayLike = (1.0, 0.0, 0.0)) -> None:
        """Bend the fabric: the curvature along ``along`` (3,) grows by ``table`` [1/(mm ms)], hollow towards +z."""
        self.cell.bend_along(finite_array(along, "along", (3,)))
        self.cell.drive(self.boundary, "curvature", table)

    def free(self, *numbers: str) -> None:
        """Let numbers of the lattice (:data:`~knittest.models.periodic_model.NUMBERS`) go where yarns pull them."""
        for name in numbers:
            self.cell.free(self.boundary, name)

    def start(self) -> ModelStepper:
        """See :meth:`Body.start`; holds all of the lattice that is neither moved nor free."""
        if self._started is None:
            for name, group in zip(NUMBERS, self.cell.images.group, strict=True):
                if group < 0:
                    self.cell.drive(self.boundary, name, constant(0.0))
        return super().start()

    def settle(self, tolerance: float = 1e-2, most_steps: int = 100_000) -> Relaxation:
        """Relax the cell where it is, its free lattice too: mean stress and forces on nodes vanish.

        Converged when the residual forces, and those on the free lattice, are below ``tolerance`` of the sum of
        contact forces. Tables are taken at their first values, which should be 0.
        """
        going = self.start()
        with limit_threads(self.threads):
            found = relax_held(self.model, going.drive, going.tally, self.dt, tolerance, most_steps)
        self._read(found.last_chunk)
        for sums in going.tally:
            sums[:] = 0.0
        return found

    def relax(self, must_converge: bool = True, **options: float) -> Relaxation:
        """See :meth:`Body.relax`; where the mean deformation ends at a speed it raises :class:`InputError`."""
        tables = [self.boundary.tables[k] for k in self.cell.images.table]
        moving = [name for name, table in zip(NUMBERS, tables, strict=True) if table.value[-1] != 0.0]
        if moving:
            raise InputError(
                f"relax: the table of {moving[0]} of the lattice ends at a nonzero speed, so there is no equilibrium; "
                "advance to the final position first, or end the table with 0"
            )
        return super().relax(must_converge, **options)

    @property
    def gradient(self) -> Array:
        """Mean deformation gradient (3, 3) of the fabric laid flat; its normal stays."""
        reference = self.cell.reference
        normal = np.cross(*reference) / self.cell.area
        return np.asarray(np.vstack([self.cell.lattice, normal]).T @ np.linalg.inv(np.vstack([reference, normal]).T))

    def nominal_stress(self) -> Array:
        """Mean nominal stress (3, 3) [N/mm] over the last chunk of steps: force per length at the start.

        Its columns are the forces on lines across x, y (and z: none).
        """
        return self._pulls()[:6].reshape(2, 3).T @ self.cell.reference / self.cell.area

    def stress(self) -> Array:
        """Mean Cauchy stress (3, 3) [N/mm] over the last chunk of steps: force per length now."""
        vectors = self.cell.lattice
        area = float(np.linalg.norm(np.cross(*vectors)))
        return self._pulls()[:6].reshape(2, 3).T @ vectors / area

    def bending_moment(self) -> float:
        """Mean moment [N] over the last chunk of steps: per length across it, of the fabric about its middle z = 0."""
        return float(self._pulls()[6]) / self.cell.area

    def _pulls(self) -> Array:
        """Mean derivatives of the energy by the numbers of the lattice."""
        if not self._row.size:
            raise InputError("stress: no step has been made yet")
        return self._support[self.cell.images.group]

    def crossings(self) -> dict[str, Crossings]:
        """Contacts that touch, by the parts of their yarns; see :class:`Crossings`."""
        return crossings(self.cell)

    @property
    def thickness(self) -> float:
        """Distance of the outermost yarn surfaces along z [mm]."""
        low, high = surfaces(self.cell, np.flatnonzero(self.cell.owned))
        return high - low
