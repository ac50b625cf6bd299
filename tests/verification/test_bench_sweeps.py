"""Sweeps of a step as ``knittest bench`` prints them: each has its time and memory, together they are the step."""

import time as clock

import numba
import pytest

from knittest.config.loading import resolve
from knittest.runs import bench
from knittest.solve.compilation import load_kernels


@pytest.fixture(scope="module")
def run():
    found = resolve(variant="2", scale="meso", preset="quick", test="picture-frame", sets=["rig.side=25"])
    load_kernels(found, threads=1)
    return found


def test_the_sweeps_are_the_step(run):
    before = numba.get_num_threads()
    try:
        head, *lines = bench.sweep_lines(run)
        sweeps, classes = lines[: len(bench.SWEEPS)], lines[len(bench.SWEEPS) + 1 :]
        step = bench._stepping(run, contact=True)
        times = []
        for _ in range(9):
            start = clock.process_time()
            step.advance()
            times.append(1e6 * (clock.process_time() - start) / bench.STEPS)
    finally:
        numba.set_num_threads(before)
    assert head.startswith("part of a step") and head.split()[4] == "us/step"
    assert [line[:26].strip() for line in sweeps] == list(bench.SWEEPS)
    cells = [line[26:].replace("%", "").split() for line in sweeps]
    numbers = [[float(v) for v in row[:4]] for row in cells]
    shares = dict(zip(bench.SWEEPS, (row[4] for row in cells), strict=True))
    assert shares["loads and tools"] == "-"
    # the large parts; a small one may take no time above that of a call of nothing
    assert all(1.0 <= float(shares[name]) <= 110.0 for name in ("contacts", "beams, integration"))
    assert sum(row[0] for row in numbers) == pytest.approx(min(times), rel=0.5)
    for time, each, rate, share in numbers:
        assert each == pytest.approx(1e3 * time / step.elements, rel=0.2, abs=0.02)
        assert rate >= 0.0 and share >= 0.0
    found = {line[:26].strip(): (float(line[26:36].removesuffix("%")), line[36:].strip()) for line in classes}
    assert sum(found[name][0] for name in ("open", "slip", "stick")) == pytest.approx(100.0, abs=1.5)
    # contacts are evaluated in blocks without branches: one of any class costs about the mean (tolerant of busy cores)
    mean = 1e3 * numbers[0][0] / step.contacts
    costs = [float(cost) for _, cost in found.values() if cost != "-"]
    assert len(costs) >= 2
    assert all(0.1 * mean < cost < 10.0 * mean for cost in costs)


def test_memory_of_a_sweep_counts_what_it_reads_and_what_it_writes(run):
    model = bench._stepping(run, contact=True).model
    sizes, n, count = bench._array_sizes(model), model.n_nodes + 1, model.tracker.count
    reads, writes = bench.SWEEPS["contacts"]
    assert set(sizes) >= {name for both in bench.SWEEPS.values() for text in both for name in text.split()}
    of_contacts = sum(sizes[name] for name in (*reads.split()[2:], *writes.split()))
    # 24 numbers are read and 19 written for a contact
    assert of_contacts == 8 * count * (2 + 2 + 1 + 1 + 1 + 3 + 3 + 3 + 3 + 3 + 1 + 1 + 2 + 1 + 1 + 3 + 3 + 3 + 3 + 3)
    assert sizes["position"] == 8 * 3 * n and sizes["half"] == 8 * 2 * count
