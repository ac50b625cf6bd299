"""Model of a periodic cell: what counts of its beams and contacts, the lattice it repeats by, and the images it has."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from knittest.base.arrays import Array, Flags, Index
from knittest.base.errors import InputError
from knittest.kernels.state import CURVATURE, Drive, Images
from knittest.models.boundary import Boundary
from knittest.models.contact_tracker import CONTACT_SKIN
from knittest.models.explicit_model import State, arrays_of, columns, put_back, rows_of, with_prefix, without_prefix
from knittest.models.image_contacts import masters
from knittest.models.tool import Table
from knittest.models.yarn_model import YarnModel


def missing_image(cell: "PeriodicModel") -> str:
    """Name the image that comes near a node of the cell without being in the model; empty if none does.

    Images next to those kept are placed as a flat fabric has them: bending takes them apart by a small part of a cell.
    """
    from scipy.spatial import cKDTree

    images, own = cell.images, np.flatnonzero(cell.owned)
    x, half = cell.nodes.position[:, own].T, float(cell.group.half_piece[own].max())
    most = np.abs(images.times).max(axis=0).astype(int) + 1
    held = set(zip(images.of[images.ghost].tolist(), images.master.tolist(), strict=True))
    number = {tuple(t): k for k, t in enumerate(images.times.astype(int).tolist())}
    reach = 2.0 * float(cell.group.bound.max()) + CONTACT_SKIN + 2.0 * half
    low, high = x.min(axis=0) - reach, x.max(axis=0) + reach
    tree, vectors = cKDTree(x), images.lattice[:6].reshape(2, 3)
    for i, j in np.ndindex(*(2 * most + 1)):
        times = (int(i - most[0]), int(j - most[1]))
        if times == (0, 0):
            continue
        moved = x + times @ vectors
        k = number.get(times)
        inside = ((moved >= low) & (moved <= high)).all(axis=1)
        for m in np.flatnonzero(inside):
            if k is not None and (k, int(own[m])) in held:
                continue
            distance, nearest = tree.query(moved[m])
            radius = cell.group.bound[own[np.array([m, int(nearest)])]].sum()
            if distance < radius + CONTACT_SKIN + 2.0 * half:
                return (
                    f"{cell.name_of(int(own[m]))} and {cell.name_of(int(own[nearest]))} approach each other where the "
                    f"cell has no image, {times[0]:+d} and {times[1]:+d} cells away; increase rig.max_slip, or halo in "
                    "the Python interface"
                )
    return ""


#: numbers of the lattice by name: components of its vectors [mm], curvature [1/mm]
NUMBERS = ("ax", "ay", "az", "bx", "by", "bz", "curvature")
#: arrays of the images that a run changes
MOVING = ("lattice", "rate", "map", "inv_mass", "table")
#: mass of a free number of the lattice over that of the cell: it stays slower than the nodes
LATTICE_MASS = 4.0
#: yarns slide slowly: number of checks of a model between those of its images
HALO_LOOKS = 20


@dataclass
class PeriodicModel(YarnModel):
    """Yarns of one cell that repeats by the vectors ``reference`` (2, 3) [mm]; nodes beyond it are images.

    ``record`` keeps what whoever deforms it wants a row of, with its state.

    Its elements, energies and masses are those of the cell alone.
    """

    #: of a cell's few beams a step costs less than a hundredth of a look
    chunk = 100

    images: Images = field(kw_only=True)
    reference: Array = field(default_factory=lambda: np.zeros((2, 3)))
    record: list[dict[str, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__post_init__()
        assert self.group.owned is not None
        self.owned, self._looks = self.group.owned, 0
        #: area of the cell at the start [mm^2]
        self.area = float(np.linalg.norm(np.cross(*self.reference)))

    @property
    def lattice(self) -> Array:
        """Vectors of the lattice now [mm], (2, 3), of the fabric laid flat."""
        return self.images.lattice[:CURVATURE].reshape(2, 3).copy()

    @property
    def curvature(self) -> float:
        """Curvature [1/mm], positive where the fabric is hollow towards its face (+z)."""
        return float(self.images.lattice[CURVATURE])

    def masters(self) -> Index:
        """See :meth:`YarnModel.masters`."""
        return masters(self.images)

    def representative_nodes(self) -> Flags:
        """See :meth:`YarnModel.representative_nodes`; all nodes of the cell."""
        return self.owned > 0.0

    def drive(self, boundary: Boundary, number: str, rate: Table) -> int:
        """Move one of :data:`NUMBERS` at ``rate`` [mm/ms, or 1/(mm ms)]; returns the group of its reaction, the
        derivative of the energy by it.
        """
        q = self._number(number)
        self.images.table[q], self.images.inv_mass[q] = boundary.table(rate), 0.0
        return self._group(boundary, q)

    def free(self, boundary: Boundary, number: str) -> int:
        """Let one of :data:`NUMBERS` go where the cell pulls it; returns its group as :meth:`drive` does."""
        q = self._number(number)
        mass = LATTICE_MASS * float(self.mass.sum())
        scale = 1.0 if q < CURVATURE else float(np.sum(self.reference**2))
        self.images.inv_mass[q] = 1.0 / (mass * scale)
        return self._group(boundary, q)

    def bend_along(self, direction: Array) -> None:
        """Let the curvature be along ``direction`` (3,) in the plane of the lattice."""
        normal = np.cross(*self.reference)
        normal = normal / np.linalg.norm(normal)
        along = direction / np.linalg.norm(direction)
        if abs(float(along @ normal)) > 1e-9:
            raise InputError("direction of bending: expected one in the plane of the lattice")
        self.images.axes[:] = along, normal, np.cross(along, normal)

    def _group(self, boundary: Boundary, q: int) -> int:
        self.images.group[q] = boundary.groups
        boundary.groups += 1
        return boundary.groups - 1

    def _number(self, name: str) -> int:
        if name not in NUMBERS:
            raise InputError(f"lattice: {name!r}; expected one of {', '.join(NUMBERS)}")
        q = NUMBERS.index(name)
        if self.images.group[q] >= 0:
            raise InputError(f"{name} of the lattice is already moved or free")
        return q

    def counted_beams(self) -> Array:
        """See :meth:`YarnModel.counted_beams`; of the cell alone."""
        return self.beams.alive * self.owned

    def kernel_drive(self, drive: Drive) -> tuple[Any, ...]:
        """Fields of ``drive``: kernels of cells are compiled with tools whether there are any or not."""
        return tuple(drive)

    def halt(self) -> None:
        """See :meth:`ExplicitModel.halt`; stops the lattice too."""
        super().halt()
        self.images.rate[:] = 0.0

    def lattice_force(self) -> float:
        """See :meth:`ExplicitModel.lattice_force`; a moment counts by the size of the cell."""
        size = np.append(np.ones(CURVATURE), 1.0 / np.linalg.norm(self.reference))
        return float(np.abs(self.images.pull * size)[self.images.inv_mass > 0.0].sum())

    def contact_force_sum(self) -> float:
        """See :meth:`ExplicitModel.contact_force_sum`."""
        if self.soft_contact is not None:
            return self.soft_contact.force_sum()
        contacts, count = self.tracker.contacts, self.tracker.count
        return float(np.linalg.norm(contacts.force[:, :count], axis=0) @ contacts.share[:count])

    def name_of(self, node: int) -> str:
        """See :meth:`YarnModel.name_of`; of the node that an image follows."""
        return super().name_of(int(self.masters()[node]))

    def diagnose(self, dt: float) -> str:
        """See :meth:`YarnModel.diagnose`; names yarns that reach missing images too."""
        self._looks += 1
        missing = missing_image(self) if self._looks % HALO_LOOKS == 1 else ""
        return super().diagnose(dt) or missing

    def state(self) -> State:
        """See :meth:`ExplicitModel.state`; adds the lattice."""
        return super().state() | arrays_of("images", self.images, MOVING) | with_prefix("record", columns(self.record))

    def restore(self, state: State) -> None:
        """See :meth:`ExplicitModel.restore`."""
        super().restore(state)
        put_back(state, "images", self.images, MOVING)
        self.record[:] = rows_of(without_prefix(state, "record"))
