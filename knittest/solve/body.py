"""A body posed by hand: a model with what acts on it, its steps, its state at rest and what is read from it."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from knittest.base.arrays import Array, Index
from knittest.base.errors import InputError, NumericalError
from knittest.kernels.shell_state import Laminate, set_strength
from knittest.kernels.threading import best_threads, limit_threads
from knittest.kernels.tool_contact import tool_energies
from knittest.models.boundary import Boundary, Readings, new_tally, take_readings
from knittest.models.chains import Chain, build_chains
from knittest.models.explicit_model import ExplicitModel
from knittest.models.fabric_model import FabricModel
from knittest.models.inputs import (
    chain_fields,
    chain_points,
    finite_array,
    number_above,
    quadrilaterals,
    warp_direction,
)
from knittest.models.macro import build_sheet
from knittest.models.natural_state import rotate_quaternions, with_equal_signs
from knittest.models.sheet_tracker import SheetContact
from knittest.models.yarn_contact import YarnContact
from knittest.models.yarn_model import YarnModel
from knittest.solve.pace import Pace
from knittest.solve.relaxation import Relaxation, relax
from knittest.solve.state import ModelStepper

#: steps between looks at displacement and damping loss
CHUNK = 20
#: nodes below which one thread is faster
SMALL = 1000


class Body:
    """A model with what acts on it, advanced by hand.

    ``boundary`` may be added to until the first advance. ``damping`` [1/ms] takes velocity in proportion to mass; it
    may change between advances.
    ``threads``: by default one for a body so small that threads would spend the step waiting for each other.
    """

    def __init__(
        self, model: ExplicitModel, safety: float = 0.9, damping: float = 0.0, threads: int | None = None
    ) -> None:
        self.model, self.dt = model, number_above(safety, "safety") * model.critical_step
        if safety > 1.0:
            raise InputError(f"safety: {safety:g}; expected at most 1, the critical time step")
        if threads is not None:
            number_above(threads, "threads", 1.0, equal=True)
        self.threads = threads or (1 if model.n_nodes < SMALL else best_threads(None))
        self.boundary = Boundary(model, self.dt)
        self._damping = number_above(damping, "damping [1/ms]", equal=True)
        self._natural = self.rotation
        self._unloaded = model.position()
        self._started: ModelStepper | None = None
        self._row, self._support = np.zeros(0), np.zeros(0)

    @classmethod
    def of_chains(
        cls,
        chains: Sequence[Chain],
        contact: YarnContact | None = None,
        part_names: tuple[str, ...] = ("yarn",),
        **options: Any,
    ) -> "Body":
        """Beam chains, whose nodes are numbered in their order; yarns touch if ``contact`` says how."""
        if not chains:
            raise InputError("chains: expected at least one")
        for name in ("normal", "tangential", "friction", "damping") if contact else ():
            number_above(getattr(contact, name), f"{name} of the contact", equal=True)
        if contact is not None and contact.patch is not None:
            number_above(contact.tangential, "tangential of the contact with a patch")
        for number, chain in enumerate(chains):
            count = len(chain_points(chain.points, number)) - 1
            chain_fields(chain.fail_strain, chain.slack, chain.degree_of_set, chain.loop_shortening, count, number)
            if not 0 <= chain.part < len(part_names):
                raise InputError(f"part {chain.part} of chain {number}: there are {len(part_names)} part_names")
        return cls(build_chains(chains, part_names, contact), **options)

    @classmethod
    def of_shells(
        cls,
        points: ArrayLike,
        cells: ArrayLike,
        laminate: Laminate,
        area_mass: float,
        thickness: float,
        warp: ArrayLike = (0.0, 1.0, 0.0),
        self_contact: SheetContact | None = None,
        **options: Any,
    ) -> "Body":
        """Shells at rest in ``points`` (n, 3) with corners ``cells`` (n_el, 4); ``area_mass`` [g/mm^2].

        They touch themselves and each other, ``thickness`` apart, if ``self_contact`` says how.
        """
        places = finite_array(points, "points", (-1, 3))
        conn = quadrilaterals(places, cells)
        warp = warp_direction(warp, places, conn)
        number_above(area_mass, "area_mass [g/mm2]")
        number_above(thickness, "thickness [mm]")
        model = build_sheet(places, conn, laminate, area_mass, thickness, warp, contact=self_contact)
        return cls(model, **options)

    def set_strength(self, strength: ArrayLike) -> None:
        """Give each shell a ``strength`` (n_el,) over the laminate's fracture strains [-]."""
        if not isinstance(self.model, FabricModel):
            raise InputError("strength: for shells only; use fail_strain of a Chain")
        share = finite_array(strength, "strength", (len(self.model.mesh.cells),))
        if (share <= 0.0).any():
            raise InputError(f"strength of shell {int(np.argmax(share <= 0.0))}: expected more than 0")
        set_strength(self.model.shells, share)

    def place(self, position: ArrayLike, turn: ArrayLike = (0.0, 0.0, 0.0)) -> None:
        """Put the nodes at ``position`` (n_nodes, 3), turned by the rotation vectors ``turn`` (n_nodes, 3) or (3,)
        [rad] from the rotations of the start, which carry what was bent into chains that are not fully set.
        """
        n = self.model.n_nodes
        places = finite_array(position, "position", (n, 3))
        vector = finite_array(turn, "turn")
        vector = np.broadcast_to(finite_array(vector, "turn", (3,) if vector.ndim == 1 else (n, 3)), (n, 3))
        rotation = rotate_quaternions(self._natural, vector)
        if isinstance(self.model, YarnModel):
            rotation = with_equal_signs(rotation)
        self.model.nodes.position[:, :n], self.model.nodes.rotation[:, :n] = places.T, rotation.T

    @property
    def time(self) -> float:
        """Time that the body has been advanced by [ms]."""
        return 0.0 if self._started is None else self._started.time

    @property
    def damping_loss(self) -> float:
        """Energy that damping has taken [mJ]."""
        return 0.0 if self._started is None else self._started.damping_loss

    @property
    def damping(self) -> float:
        """Mass-proportional damping [1/ms]."""
        return self._damping

    @damping.setter
    def damping(self, value: float) -> None:
        self._damping = number_above(value, "damping [1/ms]", equal=True)
        if self._started is not None:
            self.model.nodes.damping_factor[:] = np.exp(-value * self.dt)

    def start(self) -> ModelStepper:
        """Fix what acts on the body; returns it with the kernel's arrays (called by :meth:`advance`)."""
        if self._started is None:
            self.model.nodes.damping_factor[:] = np.exp(-self.damping * self.dt)
            self.model.prepare()
            drive, tally = self.boundary.drive(), new_tally(self.boundary)
            self._started = ModelStepper(self.model, drive, tally, self.dt, pace=Pace(self.threads))
        return self._started

    def advance(self, duration: float, watch: Callable[["Body"], None] | None = None) -> None:
        """Integrate for ``duration`` [ms]; ``watch`` is called after every chunk of at most 20 steps."""
        left = max(round(number_above(duration, "duration [ms]", equal=True) / self.dt), 1)
        self.start()
        while left > 0:
            chunk = self._safe_steps(left)
            self.step(chunk)
            left -= chunk
            if watch is not None:
                watch(self)

    def step(self, steps: int = 1) -> None:
        """Advance by ``steps`` time steps, whose mean reactions can be read then; contacts are renewed on the way.

        Raises :class:`NumericalError` for a state that no result can be read from: a collapsed element, a beam under
        more tension than its sections resist, yarns or sheets that pass each other.
        """
        if not isinstance(steps, (int, np.integer)) or steps < 1:
            raise InputError(f"steps: {steps!r}; expected a whole number of at least 1")
        going = self.start()
        left = int(steps)
        with limit_threads(self.threads):
            while left > 0:
                chunk = self._safe_steps(left)
                going.step(chunk)
                left -= chunk
                self._check_state()
        self._read(steps)

    def _safe_steps(self, left: int) -> int:
        """Steps, at most ``left``, until contacts are searched again and the state is checked."""
        return min(self.model.safe_steps(self.dt, CHUNK, self.boundary.largest_speed), left)

    def relax(self, must_converge: bool = True, **options: float) -> Relaxation:
        """Find the static state under what acts at the end of all tables; see :func:`knittest.solve.relaxation.relax`.

        Raises :class:`InputError` where a motion does not come to its end, and :class:`NumericalError` for a state that
        is not at rest after the most steps, unless that may be, or as :meth:`step` does.
        """
        moving = self.boundary.unfinished_motions()
        if moving:
            raise InputError(
                f"relax: the table of {moving[0]} ends at a nonzero speed, so there is no equilibrium; advance to the "
                "final position first, or end the table with 0"
            )
        going = self.start()
        with limit_threads(self.threads):
            found = relax(self.model, going.drive, going.tally, self.dt, unloaded=self._unloaded, look=None, **options)
        self._read(found.last_chunk)
        if must_converge and not found.converged:
            raise NumericalError(
                f"relax: no equilibrium after {found.steps} steps, residual {found.residual:.2g}; raise most_steps, or "
                "inspect the state with must_converge=False"
            )
        self._check_state()
        return found

    def _check_state(self) -> None:
        if fault := self.model.invalid_state(self.dt):
            what, _, remedy = fault.partition("; ")
            raise NumericalError(f"{what} at {self.time:.5g} ms; {remedy or 'reduce safety or the speed of motion'}")

    def _read(self, steps: int) -> None:
        going = self.start()
        self._support = going.tally.support.sum(axis=0) / steps
        self._row = take_readings(going.tally, going.drive, steps)

    @property
    def position(self) -> Array:
        """Positions [mm], (n_nodes, 3)."""
        return self.model.position()

    @property
    def rotation(self) -> Array:
        """Rotations of the nodes as unit quaternions (w, x, y, z), (n_nodes, 4)."""
        return np.ascontiguousarray(self.model.nodes.rotation[:, : self.model.n_nodes].T)

    def fields(self) -> dict[str, Array]:
        """Strains, forces and moments of the elements, (n_el,) each.

        Beams: ``axial_strain`` [-], ``axial_force``, ``shear_force`` [N], ``torsion``, ``bending`` [N mm], of it
        ``bending_normal`` about the normal of a flat section, and the vectors ``force``, ``moment`` (n_el, 3) that the
        side of the second node exerts on that of the first. Shells: ``strain_warp``, ``strain_weft`` [-],
        ``shear_angle`` [rad], ``force_warp``, ``force_weft`` [N/mm], ``moment_warp``, ``moment_weft``,
        ``moment_twist`` [N]. ``alive`` is 1 for those that are whole.
        """
        return self.model.resultants()

    def contact_forces(self) -> tuple[Array, Array, Index]:
        """Places [mm] and forces [N] where yarns touch, (n, 3) each; forces on the first of their chains (n, 2)."""
        return self.model.contact_forces()

    @property
    def velocity(self) -> Array:
        """Velocities half a step ago [mm/ms], (n_nodes, 3); may be set before the first advance."""
        return self.model.nodes.velocity[:, : self.model.n_nodes].T

    @property
    def spin(self) -> Array:
        """Angular velocities in global axes [rad/ms], (n_nodes, 3)."""
        return self.model.nodes.spin[:, : self.model.n_nodes].T

    def readings(self) -> Readings:
        """Mean reactions and forces on tools over the last chunk of steps."""
        return Readings.of(self._row, self.start().drive.tools.kind.size)

    def reaction(self, group: int) -> float:
        """Mean sum of the reactions [N or N mm] over the last chunk of what ``boundary.move`` numbered ``group``.

        One degree of freedom a group gives a force or a moment; several are added up.
        """
        self._check_group(group)
        return float(self._support[group])

    def conjugate(self, group: int) -> float:
        """Mean reaction of ``group`` conjugate to its table: each reaction times its scale."""
        self._check_group(group)
        return float(self._row[group])

    def _check_group(self, group: int) -> None:
        if group not in range(self.boundary.groups):
            raise InputError(f"reaction of group {group}: expected a number returned by boundary.move")
        if not self._row.size:
            raise InputError("reaction: no step has been made yet")

    def energies(self) -> dict[str, float]:
        """Energies [mJ]: kinetic, internal, contact, hourglass, friction, contact_damping (of free tools too),
        damping, eroded; what was put in, external and contact_recovery (given to contacts found late); their balance;
        and of friction, that of crossings against spin, friction_of_spin.

        Takes one step, because central differences conserve the kinetic energy of the velocities around an instant.
        """
        going = self.start()
        stored, tools = self.model.stored_energies(), going.drive.tools
        elastic, moving, _ = tool_energies(self.model.nodes, tools, going.drive.touch, self.model.n_nodes)
        before, spinning = going.work()[0], self._spinning()
        self.step(1)
        external, friction, eroded, damped = going.work()
        external = 0.5 * (before + external)  # half of the work of this step is done after the instant of its forces
        found = {
            "kinetic": going.kinetic + 0.5 * (spinning - self._spinning()) + moving,
            "internal": float(stored.internal.sum()),
            "contact": stored.contact + elastic,
            "hourglass": stored.hourglass,
            "friction": friction,
            "contact_damping": damped,
            "damping": self.damping_loss,
            "eroded": eroded,
        }
        balance = external + going.recovered_energy - sum(found.values())
        given = {"external": external, "contact_recovery": going.recovered_energy}
        return found | given | {"balance": balance, "friction_of_spin": going.friction_losses()["spin"]}

    def _spinning(self) -> float:
        """Rotary kinetic energy [mJ] half a step earlier."""
        return 0.5 * float((self.model.inertia[:, None] * self.spin**2).sum())
