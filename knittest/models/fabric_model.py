"""The shell strip as a model of the explicit driver."""

from dataclasses import dataclass

import numpy as np

from knittest.history import Overlaps
from knittest.kernels.drive_state import Drive
from knittest.kernels.explicit import advance_fabric
from knittest.kernels.health import smallest_shell
from knittest.kernels.shell_output import shell_energies, shell_fields
from knittest.kernels.shell_state import Laminate, Shells
from knittest.kernels.state import Tally
from knittest.models.explicit_model import Array, ExplicitModel, Index, Stored
from knittest.snapshot import State, arrays_of, put_back

#: arrays of the shells that a run changes
CHANGING = ("state", "corner", "fail_time")
#: area over reference area below which a shell has collapsed
SMALLEST = 0.05


@dataclass
class FabricModel(ExplicitModel):
    """Shells without contact."""

    shells: Shells
    laminate: Laminate

    def prepare(self) -> Overlaps:
        """Nothing touches."""
        return Overlaps()

    def safe_steps(self, dt: float, most: int) -> int:
        """Shells need no attention between samples."""
        return most

    def advance(self, steps: int, time: float, dt: float, drive: Drive, tally: Tally, scratch: Array) -> None:
        """See :func:`knittest.kernels.explicit.advance_fabric`."""
        advance_fabric(steps, time, dt, self.nodes, self.parts, self.shells, self.laminate, *drive, tally, scratch)

    def stored(self) -> Stored:
        """Energies of the living shells."""
        internal, hourglass = shell_energies(self.nodes, self.shells, self.laminate)
        return Stored(np.array([internal]), hourglass=hourglass)

    def failed(self) -> Index:
        """Deleted shells."""
        return np.array([np.count_nonzero(np.isfinite(self.shells.fail_time))])

    def fields(self) -> dict[str, Array]:
        """Force per width [N/mm], strain [-], shear angle [rad] and alive flag of every shell."""
        n_el = len(self.mesh.cells)
        names = ("strain_warp", "strain_weft", "shear_angle", "force_warp", "force_weft")
        values = dict(zip(names, shell_fields(n_el, self.nodes, self.shells, self.laminate), strict=True))
        return values | {"alive": np.isinf(self.shells.fail_time[:n_el]).astype(float)}

    def complaint(self, dt: float) -> str:
        """Names a shell without area; the bound behind the time step holds at any other distortion."""
        shell, ratio = smallest_shell(
            self.nodes.position, self.shells.conn, self.shells.fail_time, self.shells.state
        )  # fmt: skip
        return f"shell {shell} has collapsed to {100.0 * ratio:.1f} % of its area" if ratio < SMALLEST else ""

    def state(self) -> State:
        """See :meth:`ExplicitModel.state`; adds living shells and corner forces."""
        return super().state() | arrays_of("shells", self.shells, CHANGING)

    def restore(self, state: State) -> None:
        """See :meth:`ExplicitModel.restore`."""
        super().restore(state)
        put_back(state, "shells", self.shells, CHANGING)

    def name_of(self, node: int) -> str:
        """The shells around ``node``."""
        return f"shell {int(np.flatnonzero((self.mesh.cells == node).any(axis=1))[0])}"
