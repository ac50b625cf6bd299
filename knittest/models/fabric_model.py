"""Sheets of shells as a model of the explicit driver."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import get_num_threads

from knittest.base.arrays import Array, Index
from knittest.base.history import Overlaps
from knittest.kernels.explicit import advance_fabric, advance_fabric_alone
from knittest.kernels.in_plane import Bends
from knittest.kernels.in_plane_blocks import bend_energy
from knittest.kernels.monitor import smallest_shell
from knittest.kernels.sheet_contact import sheet_statistics
from knittest.kernels.sheet_surface import NO_LAW, NO_MESH, empty_contacts
from knittest.kernels.shell_output import shell_energies, shell_fields, shell_moments
from knittest.kernels.shell_state import BLOCK, CORNER_ROWS, Laminate, Shells
from knittest.kernels.state import Drive, Tally
from knittest.models.explicit_model import (
    ExplicitModel,
    State,
    StoredEnergies,
    arrays_of,
    put_back,
    with_prefix,
    without_prefix,
)
from knittest.models.in_plane import bend_bound, bend_bound_now
from knittest.models.sheet_tracker import SheetTracker

#: arrays of the shells that a run changes
CHANGING = ("state", "corner", "fail_time")
#: arrays of their fibres' bending in the plane that a run changes
BENDING = ("alive", "broken")
#: contact arguments of the kernel for sheets without contact
BLIND = (NO_MESH, empty_contacts(0), 0, NO_LAW)
#: mechanisms by which shells store energy: twisting and transverse shear are with bending
MECHANISMS = ("stretching", "bending", "shear", "in_plane_bending")
#: area over reference area below which a shell has collapsed
SMALLEST = 0.05
#: shear angle [deg] at which it is shear that took the area, which no smaller step brings back
SHEARED = 60.0
SOFT = "the shear law does not rise enough at such angles; extend fabric.macro.shear by larger angles and forces"


@dataclass
class FabricModel(ExplicitModel):
    """Shells, which touch each other if ``tracker`` says how."""

    shells: Shells
    laminate: Laminate
    bends: Bends
    tracker: SheetTracker | None = None

    @cached_property
    def bending_at_rest(self) -> float:
        """Part of the fibres' bending in the plane in the bound behind the time step [1/ms^2]."""
        return bend_bound(self.bends, self.mass)

    def prepare(self) -> Overlaps:
        """See :meth:`SheetTracker.settle`."""
        return self.tracker.settle() if self.tracker else Overlaps()

    def safe_steps(self, dt: float, most: int, speed: float = 0.0) -> int:
        """See :meth:`SheetTracker.safe_steps`."""
        return self.tracker.safe_steps(dt, most, speed) if self.tracker else most

    def advance(self, steps: int, time: float, dt: float, drive: Drive, tally: Tally, scratch: Array) -> None:
        """Renew contacts that may come near, then advance."""
        if self.tracker:
            self.tracker.update(steps * dt)
        self.step(steps, time, dt, drive, tally, scratch)

    def step(self, steps: int, time: float, dt: float, drive: Drive, tally: Tally, scratch: Array) -> None:
        """See :meth:`ExplicitModel.step`."""
        contact = self.tracker.arguments if self.tracker else BLIND
        arguments = (
            steps, time, dt, self.nodes, self.parts, self.shells, self.laminate, self.bends, *contact,
            *self.kernel_drive(drive), tally, scratch,
        )  # fmt: skip
        if (threads := get_num_threads()) > 1:
            advance_fabric(threads, *arguments)
        else:
            advance_fabric_alone(*arguments)

    def stored_energies(self) -> StoredEnergies:
        """Energies of the living shells, of their fibres' bending in the plane and of their contacts."""
        *elastic, hourglass = shell_energies(self.nodes, self.shells, self.laminate)
        elastic.append(bend_energy(self.nodes, self.bends))
        found = {name: np.array([energy]) for name, energy in zip(MECHANISMS, elastic, strict=True)}
        internal = np.array([sum(elastic)])
        if self.tracker is None:
            return StoredEnergies(internal, hourglass=hourglass, mechanisms=found)
        mesh, contacts, count, law = self.tracker.arguments
        contact, penetration = sheet_statistics(count, self.nodes, self.shells, mesh, law, contacts)
        return StoredEnergies(internal, contact, hourglass, penetration, found)

    def contact_force_sum(self) -> float:
        """See :meth:`ExplicitModel.contact_force_sum`."""
        return self.tracker.contact_force_sum() if self.tracker else 0.0

    def largest_force(self) -> float:
        """See :meth:`ExplicitModel.largest_force`; components of the forces of corners."""
        corners = self.shells.corner.reshape(-1, 4, CORNER_ROWS // 4, BLOCK)
        return float(np.abs(corners[:, :, :3]).max(initial=0.0))

    def search_seconds(self) -> float:
        """See :class:`SheetTracker`."""
        return self.tracker.seconds if self.tracker else 0.0

    def count_failed(self) -> Index:
        """Deleted shells."""
        return np.array([np.count_nonzero(np.isfinite(self.shells.fail_time))])

    def fields(self, position: Array | None = None, time: float = np.inf) -> dict[str, Array]:
        """Force per width [N/mm], strain [-], shear angle [rad] and alive flag of every shell; see
        :meth:`ExplicitModel.fields`.
        """
        n_el = len(self.mesh.cells)
        nodes = self.nodes if position is None else self.nodes._replace(position=position)
        alive = (self.shells.fail_time[:n_el] >= time).astype(float)
        *strains, warp, weft = shell_fields(n_el, nodes, self.shells, self.laminate)
        values = dict(zip(("strain_warp", "strain_weft", "shear_angle"), strains, strict=True))
        return values | {"force_warp": warp * alive, "force_weft": weft * alive, "alive": alive}

    def resultants(self) -> dict[str, Array]:
        """See :meth:`ExplicitModel.resultants`; forces per width [N/mm], moments per width [N]."""
        n_el = len(self.mesh.cells)
        moments = shell_moments(n_el, self.nodes, self.shells, self.laminate)
        return self.fields() | dict(zip(("moment_warp", "moment_weft", "moment_twist"), moments, strict=True))

    def invalid_state(self, dt: float) -> str:
        """Name a shell without area, or a node that passed through a shell; empty if there is none."""
        shell, ratio = smallest_shell(
            self.nodes.position, self.shells.conn, self.shells.fail_time, self.shells.state
        )  # fmt: skip
        if ratio < SMALLEST:
            angle = float(np.rad2deg(np.abs(self.fields()["shear_angle"][shell])))
            fault = f"shell {shell} has collapsed to {100.0 * ratio:.1f} % of its area"
            return f"{fault}, sheared by {angle:.0f} deg; {SOFT}" if angle > SHEARED else fault
        return self.tracker.diagnose() if self.tracker else ""

    def stable_step(self) -> tuple[float, str]:
        """Step [ms] that the bending of yarns in the plane of the shells bears now, and the node that limits it.

        Shear that closes the angle of crumpled yarns stiffens their bending without limit. Less distortion leaves the
        bound behind the time step valid (:mod:`knittest.models.in_plane` says how far).
        """
        if not self.bends.alive.size:
            return super().stable_step()
        now, node = bend_bound_now(self.bends, self.nodes.position, self.mass)
        stiffest = (2.0 / self.critical_step) ** 2 - self.bending_at_rest + now
        return (
            2.0 / stiffest**0.5,
            f"in-plane bending of sheared yarns at node {node} of {self.name_of(node)}",
        )

    def state(self) -> State:
        """See :meth:`ExplicitModel.state`; adds living shells, corner forces and contacts."""
        contacts = with_prefix("tracker", self.tracker.state()) if self.tracker else {}
        return super().state() | arrays_of("shells", self.shells, CHANGING) | self._bending() | contacts

    def restore(self, state: State) -> None:
        """See :meth:`ExplicitModel.restore`."""
        super().restore(state)
        put_back(state, "shells", self.shells, CHANGING)
        if self._bending():
            put_back(state, "bends", self.bends, BENDING)
        if self.tracker:
            self.tracker.restore(without_prefix(state, "tracker"))

    def _bending(self) -> State:
        """Flags of the fibres that are whole, where they bend in the plane."""
        return arrays_of("bends", self.bends, BENDING) if self.bends.alive.size else {}

    def name_of(self, node: int) -> str:
        """The shells around ``node``."""
        return f"shell {int(np.flatnonzero((self.mesh.cells == node).any(axis=1))[0])}"
