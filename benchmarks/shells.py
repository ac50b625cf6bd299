"""Throughput of the shells: forces and gather, three layers, tension curves of eight knots."""

import statistics
import time
from collections.abc import Callable

import numba
import numpy as np
from numba import njit, prange

from knittest.kernels.shell_blocks import gather_shells, shell_forces
from knittest.kernels.shell_state import BLOCK, SCRATCH, Laminate, build_shells
from knittest.kernels.vec import PARALLEL, PARTITIONS
from knittest.models.explicit_model import make_nodes

SIZES = ((40, 40), (250, 110))
KNOTS = 8
REPEATS = 7


def laminate() -> Laminate:
    """Eight hinges in each direction, linear shear."""
    knee, slope = np.tile(np.linspace(0.0, 0.014, KNOTS), (2, 1)), np.full((2, KNOTS), 900.0)
    return Laminate(
        1.1, np.array([2.0, 1.5]), np.full(2, 70.0), knee, slope, np.zeros(1), np.array([0.5]), 0.0, 1.0, 0.3,
        np.array([4.0, 5.0]), np.full(2, 3.0), 0.25, 0.02, 0.05, 0.005, np.full(2, np.inf),
    )  # fmt: skip


def sheet(nx: int, ny: int) -> tuple[np.ndarray, np.ndarray]:
    """Slightly irregular wavy sheet of shells of 2.5 mm: positions (n, 3) and corners."""
    i, j = np.meshgrid(np.arange(nx + 1), np.arange(ny + 1), indexing="ij")
    jitter = np.random.default_rng(0).normal(0.0, 0.1, (2, *i.shape))
    x, y = 2.5 * i + jitter[0], 2.5 * j + jitter[1]
    corner = (np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)).ravel()
    z = 2.0 * np.sin(x / 20.0) * np.cos(y / 20.0)
    conn = np.column_stack([corner, corner + ny + 1, corner + ny + 2, corner + 1])
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), conn


@njit(**PARALLEL)
def step(blocks, n_nodes, nodes, shells, law, scratch):
    """Forces of all shells and their gather, over the fixed partitions."""
    for p in prange(PARTITIONS):
        q = np.int64(p)
        shell_forces(blocks * q // PARTITIONS, blocks * (q + 1) // PARTITIONS, 0.0, nodes, shells, law, scratch[q])
    for p in prange(PARTITIONS):
        q = np.int64(p)
        gather_shells(n_nodes * q // PARTITIONS, n_nodes * (q + 1) // PARTITIONS, nodes, shells)


def median_time(call: Callable[[], object]) -> float:
    """Median time [s] of one call over blocks of calls of about 0.1 s."""
    call()
    start = time.perf_counter()
    call()
    count = max(1, int(0.1 / (time.perf_counter() - start)))
    samples = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        for _ in range(count):
            call()
        samples.append((time.perf_counter() - start) / count)
    return statistics.median(samples)


def main() -> None:
    """Print nanoseconds a shell and step, and millions of shell-steps a second."""
    law = laminate()
    for size in SIZES:
        position, conn = sheet(*size)
        shells, n = build_shells(position, conn, np.array([1.0, 0.0, 0.0])), len(position)
        nodes = make_nodes(position, np.ones(n), np.ones(n))
        scratch, blocks = np.zeros((PARTITIONS, SCRATCH)), len(shells.fail_time) // BLOCK
        parts = {
            "forces, 1 thread": lambda: shell_forces(0, blocks, 0.0, nodes, shells, law, scratch[0]),  # noqa: B023
            "gather, 1 thread": lambda: gather_shells(0, n, nodes, shells),  # noqa: B023
        }
        for name, call in parts.items():
            print(f"{len(conn):6d} shells  {name:18s} {median_time(call) / len(conn) * 1e9:7.1f} ns")
        for threads in range(1, min(2, numba.config.NUMBA_NUM_THREADS) + 1):
            numba.set_num_threads(threads)
            one = median_time(lambda: step(blocks, n, nodes, shells, law, scratch)) / len(conn)  # noqa: B023
            print(f"{len(conn):6d} shells  step, {threads} thread(s)  {one * 1e9:7.1f} ns  {1e-6 / one:6.1f} M/s")


if __name__ == "__main__":
    main()
