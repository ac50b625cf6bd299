"""Throughput of the kernels and the time of a run by part; medians of repeated measurements."""

import statistics
import time as clock
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit

from knittest.base.arrays import Array
from knittest.base.machine import processor_ticks, steal_share
from knittest.config.run import Run
from knittest.kernels.beam import advance_beams
from knittest.kernels.contact import POINT
from knittest.kernels.contact_blocks import scatter_contacts
from knittest.kernels.explicit import SCRATCH, apply_outside_forces, contact_share
from knittest.kernels.state import Contacts, Drive, Tally
from knittest.kernels.threading import best_threads
from knittest.kernels.vec import ALLOCATING, PARTITIONS, U, rows4
from knittest.models.boundary import Boundary, new_tally
from knittest.models.contact_tracker import OF_CONTACTS
from knittest.models.explicit_model import ExplicitModel
from knittest.models.yarn_model import YarnModel
from knittest.runs.specimen import prepare
from knittest.solve.compilation import load_kernels
from knittest.solve.simulation import simulate

STEPS, REPEATS = 50, 5
#: gap [mm] from which a contact that waits could be left alone for some steps
WIDE_GAP = 0.02


def _median_time(call: Callable[[], object]) -> float:
    call()
    times = []
    for _ in range(REPEATS):
        start = clock.perf_counter()
        call()
        times.append(clock.perf_counter() - start)
    return statistics.median(times)


@dataclass(frozen=True)
class Stepping:
    """A model in its rig, ready for steps without motion, with its number of yarn ``contacts``."""

    model: ExplicitModel
    drive: Drive
    tally: Tally
    dt: float
    scratch: Array
    contacts: int

    @property
    def elements(self) -> int:
        """Number of elements."""
        return len(self.model.mesh.cells)

    def advance(self) -> None:
        """Advance by STEPS."""
        self.model.advance(STEPS, 0.0, self.dt, self.drive, self.tally, self.scratch)


def _stepping(run: Run, contact: bool) -> Stepping:
    """A new model of ``run``, with or without ``contact`` of yarns."""
    meso = run.model.meso.model_copy(update={"contact": contact})
    prepared = prepare(run.model_copy(update={"model": run.model.model_copy(update={"meso": meso})}))
    model = prepared.model
    scratch, dt = np.zeros((PARTITIONS, SCRATCH)), run.solver.safety * model.critical_step
    boundary = Boundary(model, dt)
    prepared.rig.constrain(boundary)
    drive, tally = boundary.drive(), new_tally(boundary)
    model.prepare()
    contacts = model.tracker.count if contact and isinstance(model, YarnModel) else 0
    return Stepping(model, drive, tally, dt, scratch, contacts)


def kernel_lines(yarns: Run, loops: Run, shells: Run) -> Iterator[str]:
    """Element steps per second by kernel, on one thread and on all, and the processor time that the host took."""
    import numba

    for run in (yarns, shells):
        load_kernels(run, threads=best_threads(None))
    cases = [
        ("beams", yarns, False), ("beams and contact", yarns, True),
        ("loops and contact", loops, True), ("shells of forming", shells, False),
    ]  # fmt: skip
    heads = (f"{'kernel':<20}", f"{'elements':>10}", f"{'contacts each':>15}", f"{'threads':>9}")
    yield "".join((*heads, f"{'ns/element-step':>17}", f"{'M element-steps/s':>19}"))
    before = processor_ticks()
    for name, run, contact in cases:
        found = _stepping(run, contact)
        for threads in sorted({1, best_threads(None)}):
            numba.set_num_threads(threads)
            seconds = _median_time(found.advance) / STEPS / found.elements
            each = f"{found.contacts / found.elements:.2f}" if contact else "-"
            yield f"{name:<20}{found.elements:>10}{each:>15}{threads:>9}{1e9 * seconds:>17.1f}{1e-6 / seconds:>19.1f}"
    taken = steal_share(before, processor_ticks())
    share = "not known" if taken is None else f"{100.0 * taken:.1f} %"
    yield f"processor time taken by the host: {share}"


#: arrays that each sweep of a step reads, and those that it writes; of nodes, contacts and beams. Nodes that contacts
#: press are in the cache
SWEEPS: dict[str, tuple[str, str]] = {
    "contacts": (
        "position spin piece parameter line reach slipping spring offset tangent other_tangent force arm share",
        "parameter reach slipping spring offset tangent other_tangent force",
    ),
    "contact forces to nodes": (
        "half piece parameter force offset arm couple", "",
    ),
    "loads and tools": ("velocity damping_factor node_force", "node_force"),
    "beams, integration": (
        "position rotation velocity spin node_force node_moment inv_mass inv_inertia damping_factor tangent_of_beam "
        "inv_length alive fail_strain slack", "position rotation velocity spin node_force",
    ),
}  # fmt: skip

#: sums, products, quotients and roots of a contact, of a contact that presses on both its yarns, and of a beam with one
#: hinge; counted by ``tests/unit/test_bench_operations.py``
OPERATIONS = {"contacts": 670, "contact forces to nodes": 118, "beams, integration": 242}
#: products and sums in a row of the loop that measures the speed of arithmetic
IN_A_ROW = 16


def sweep_lines(run: Run) -> Iterator[str]:
    """Time of each sweep of a step of yarns on one thread, its rooflines, and the cost of contacts by class.

    The last two columns are the shares of two rooflines: of the speed at which memory of the same size is copied, and
    of the speed at which this processor multiplies and adds numbers in its registers (Williams, Waterman and Patterson
    2009, Communications of the ACM 52, 65). Tools and loads have no number of operations.
    """
    import numba

    found = _stepping(run, contact=True)
    model = found.model
    assert isinstance(model, YarnModel)
    numba.set_num_threads(1)
    found.advance()
    sizes = _array_sizes(model)
    copied, computed = _copy_speed(sum(sizes.values())), _arithmetic_speed()
    pressing = int((model.tracker.contacts.force[:, : found.contacts] != 0.0).any(axis=0).sum())
    numbers = {
        "contacts": found.contacts, "contact forces to nodes": pressing, "beams, integration": found.elements
    }  # fmt: skip
    heads = (f"{'us/step':>10}", f"{'ns/element':>13}", f"{'GB/s':>8}", f"{'of copying':>13}", f"{'of arithmetic':>15}")
    yield "".join((f"{'part of a step':<26}", *heads))
    for (name, (reads, writes)), call in zip(SWEEPS.items(), _sweep_calls(found, model), strict=True):
        seconds = _own_time(call)
        moved = sum(sizes[one] for one in (*reads.split(), *writes.split()))
        rate, each = moved / seconds if seconds > 0.0 else 0.0, 1e9 * seconds / found.elements
        share = "-"
        if name in OPERATIONS and seconds > 0.0:
            share = f"{100.0 * OPERATIONS[name] * numbers[name] / seconds / computed:.0f} %"
        of_copying = f"{100.0 * rate / copied:.0f} %"
        yield f"{name:<26}{1e6 * seconds:>10.1f}{each:>13.2f}{1e-9 * rate:>8.1f}{of_copying:>13}{share:>15}"
    yield from _class_lines(found, model)


def _least_time(call: Callable[[int], None], whole: int) -> float:
    """Least mean time of ``call``(``whole``), which is small beside that of the call itself."""
    call(whole)
    times = []
    for _ in range(REPEATS):
        start = clock.process_time()
        for _ in range(STEPS):
            call(whole)
        times.append((clock.process_time() - start) / STEPS)
    return min(times)


def _own_time(call: Callable[[int], None]) -> float:
    """Time [s] of ``call`` beyond that of a call of nothing."""
    return max(_least_time(call, 1) - _least_time(call, 0), 0.0)


def _sweep_calls(found: Stepping, model: YarnModel) -> list[Callable[[int], None]]:
    """Calls of the :data:`SWEEPS` over all partitions: of the whole (1), or of nothing (0), which Python takes too."""
    nodes, parts, beams, w = model.nodes, model.parts, model.beams, found.scratch[0]
    contacts = model.tracker.contacts
    tables, _, loads, tools, touch = model.kernel_drive(found.drive)
    no_half = contacts._replace(half_start=np.zeros_like(contacts.half_start))
    no_load = loads._replace(start=np.zeros_like(loads.start))
    no_node = parts._replace(node=np.zeros_like(parts.node))

    def collect(whole: int) -> None:
        for p in range(PARTITIONS):
            scatter_contacts(p, nodes, contacts if whole else no_half)

    def act(whole: int) -> None:
        where, what = (parts, loads) if whole else (no_node, no_load)
        for p in range(PARTITIONS):
            apply_outside_forces(p, found.dt, nodes, where, tables, what, tools, touch, found.tally, w)

    def integrate(whole: int) -> None:  # by no time: nothing moves
        for start, stop, section in parts.span.tolist():
            advance_beams(start, stop if whole else start, section, 0.0, 0.0, nodes, beams, w)

    return [_evaluation(found, model, contacts), collect, act, integrate]


def _array_sizes(model: YarnModel) -> dict[str, int]:
    """Bytes of the arrays in :data:`SWEEPS`."""
    nodes, count = model.nodes, model.tracker.count
    sizes = {name: getattr(model.beams, name).nbytes for name in ("inv_length", "alive", "fail_strain", "slack")}
    sizes |= {name: getattr(nodes, name).nbytes for name in nodes._fields if name not in ("force", "moment")}
    sizes |= {"tangent_of_beam": model.beams.tangent.nbytes}
    sizes |= {"node_force": nodes.force.nbytes, "node_moment": nodes.moment.nbytes}
    contacts = model.tracker.contacts
    for name in (*SWEEPS["contacts"][0].split()[2:], "couple"):
        sizes[name] = getattr(contacts, name)[..., :count].nbytes
    return sizes | {"half": 2 * count * contacts.half.itemsize}


def _copy_speed(size: int) -> float:
    """Bytes read and written in a second where ``size`` bytes are copied within as many."""
    source = np.ones(size // 16)
    target = np.zeros_like(source)
    return 2 * source.nbytes / _least_time(lambda _: np.copyto(target, source), 1)


@njit(**{**ALLOCATING, "cache": False})
def _multiply_and_add(rows: Array, factor: float, term: float, times: int) -> None:
    """Replace the numbers of four rows by ``factor`` times them plus ``term``, IN_A_ROW times, all of it ``times``."""
    first, second, third, fourth = rows4(rows)
    for _ in range(times):
        for k in range(U(first.size)):
            a, b, c, d = first[k], second[k], third[k], fourth[k]
            for _ in range(IN_A_ROW):
                a, b, c, d = a * factor + term, b * factor + term, c * factor + term, d * factor + term
            first[k], second[k], third[k], fourth[k] = a, b, c, d


def _arithmetic_speed() -> float:
    """Products and sums of numbers in registers in a second, four independent ones at a time."""
    rows, times = np.ones((4, 64)), 40
    seconds = _least_time(lambda _: _multiply_and_add(rows, 0.999, 0.001, times), 1)
    return 2.0 * rows.size * IN_A_ROW * times / seconds


def _class_lines(found: Stepping, model: YarnModel) -> Iterator[str]:
    """Share of the contacts that are open, stick, slip or lie along a yarn, and time [ns] to evaluate one of each.

    As many contacts as the model has are evaluated, all of one class. Copies of few contacts read nodes in the cache.
    """
    contacts, count = model.tracker.contacts, model.tracker.count
    pressing = (contacts.force[:, :count] != 0.0).any(axis=0)
    slipping, line = pressing & (contacts.slipping[:count] > 0.0), contacts.line[:count] != POINT
    gap = np.linalg.norm(contacts.offset[:, :count], axis=0) - contacts.reach[:count]
    classes = {
        "open": ~pressing, f"open by more than {WIDE_GAP:g} mm": gap > WIDE_GAP, "slip": slipping,
        "stick": pressing & ~slipping, "side by side": line,
    }  # fmt: skip
    yield f"{f'class of {count} contacts':<26}{'share':>10}{'ns/contact':>13}"
    for name, members in classes.items():
        cost = "-"
        if members.any():
            taken = np.sort(np.resize(np.flatnonzero(members), count))
            copies = {
                field: getattr(contacts, field)[..., taken].copy() for field in OF_CONTACTS
                if field not in ("half", "half_start") and getattr(contacts, field).shape[-1]
            }  # fmt: skip
            calls = contacts._replace(**copies)
            cost = f"{1e9 * _own_time(_evaluation(found, model, calls)) / count:.1f}"
        yield f"{name:<26}{100.0 * float(members.mean() if count else 0.0):>8.0f} %{cost:>13}"


def _evaluation(found: Stepping, model: YarnModel, contacts: Contacts) -> Callable[[int], None]:
    """Call that evaluates all ``contacts`` (1) or none (0)."""
    oval = True if model.group.excess.size else None

    def evaluate(whole: int) -> None:
        for p in range(PARTITIONS):
            contact_share(
                p, whole * model.tracker.count, found.dt, model.nodes, contacts, model.beams.alive, model.law,
                model.law.spin, oval, found.tally, found.scratch[0],
            )  # fmt: skip

    return evaluate


def run_lines(run: Run) -> Iterator[str]:
    """Wall time of a tensile run by part, with compiled kernels and cached relaxed cell."""
    prepare(run)
    start = clock.perf_counter()
    prepared = prepare(run)
    built = clock.perf_counter()
    _, cost = simulate(prepared.model, prepared.rig, run.solver, run.output)
    end = clock.perf_counter()
    search = prepared.model.search_seconds()
    elements = len(prepared.model.mesh.cells)
    what = f"{run.fabric.name} {run.direction}, preset {run.model.preset}"
    yield f"run: {what}, {elements} elements, {cost.steps} steps"
    whole = end - start
    for name, seconds in (
        ("geometry and arrays", built - start),
        ("contact search", search),
        ("steps", cost.advance_s - search),
        ("energies, frames", end - built - cost.advance_s),
    ):
        yield f"  {name:<22}{seconds:8.2f} s {100.0 * seconds / whole:6.1f} %"
    yield f"  {'whole':<22}{whole:8.2f} s, {1e-6 * cost.steps * elements / whole:.1f} M element-steps/s overall"
