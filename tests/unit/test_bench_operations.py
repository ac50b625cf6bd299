"""Arithmetic operations of a sweep as ``knittest bench`` states them, counted by numbers that count themselves."""

import json
import math
import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from knittest.config.loading import resolve
from knittest.runs import bench


class Counted(float):
    """A number that counts its sums, products, quotients and roots."""

    count = 0

    def sqrt(self):
        """Square root, as numpy asks it of an object."""
        Counted.count += 1
        return Counted(float(self) ** 0.5)

    def __neg__(self):
        return Counted(-float(self))


def _counting(name):
    exact = getattr(float, name)

    def operation(self, other):
        Counted.count += 1
        return Counted(exact(self, float(other)))

    return operation


for _name in ("add", "radd", "sub", "rsub", "mul", "rmul", "truediv", "rtruediv", "pow"):
    setattr(Counted, f"__{_name}__", _counting(f"__{_name}__"))


def count_operations(path):
    """Print operations of a contact, of the forces of a contact on both yarns, and of a beam; kernels are not compiled.

    ``path`` holds the fields of nodes, beams, contacts and law, the time step and a run of beams.
    """
    import numpy as np

    math.sqrt = lambda x: Counted(x).sqrt()  # before the kernels take it
    from knittest.kernels import beam, contact_blocks
    from knittest.kernels.explicit import SCRATCH
    from knittest.kernels.state import Beams, ContactLaw, Contacts, Nodes

    def numbers(array):
        some = np.empty(array.shape, object)
        some[...] = np.frompyfunc(Counted, 1, 1)(array) if array.size else some
        return some if array.dtype.kind == "f" else array

    stored = pickle.loads(Path(path).read_bytes())
    nodes, beams, contacts = (
        kind(**{name: numbers(array) for name, array in stored[key].items()})
        for kind, key in ((Nodes, "nodes"), (Beams, "beams"), (Contacts, "contacts"))
    )
    law = ContactLaw(**{name: Counted(value) for name, value in stored["law"].items()})
    scratch, dt, found = numbers(np.zeros(SCRATCH)), Counted(stored["dt"]), {}

    def count(name, number, call, *arguments):
        Counted.count = 0
        call(*arguments)
        found[name] = Counted.count / number

    some = min(64, stored["count"])
    evaluated = ((0, some), dt, nodes, contacts, beams.alive, law, None, None, scratch)
    count("contacts", some, contact_blocks.contact_forces, *evaluated)
    contacts.force[:] = Counted(1.0)
    halves = int(contacts.half_start[1] - contacts.half_start[0])
    count("contact forces to nodes", halves / 2, contact_blocks.scatter_contacts, 0, nodes, contacts)
    start, stop, section = (int(v) for v in stored["span"])
    integrated = (start, stop, section, 0.0, dt, nodes, beams, scratch)
    count("beams, integration", stop - start, beam.advance_beams, *integrated)
    print(json.dumps(found))


def test_operations_of_a_sweep(tmp_path):
    run = resolve(variant="2", scale="meso", preset="quick", test="picture-frame", sets=["rig.side=12"])
    found = bench._stepping(run, contact=True)
    model = found.model
    stored = {
        "nodes": model.nodes._asdict(), "beams": model.beams._asdict(), "law": model.law._asdict(),
        "contacts": model.tracker.contacts._asdict(), "count": model.tracker.count, "dt": found.dt,
        "span": model.parts.span[0],
    }  # fmt: skip
    path = tmp_path / "model.pickle"
    path.write_bytes(pickle.dumps(stored))
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run(
        [sys.executable, __file__, path], capture_output=True, text=True, env=environment, check=True, timeout=300
    )
    assert json.loads(done.stdout) == pytest.approx(bench.OPERATIONS, rel=0.02)


if __name__ == "__main__":
    count_operations(sys.argv[1])
