"""Progress of a specimen that comes to rest, apart from the test itself."""

from knittest.config.loading import resolve
from knittest.laboratory.report_base import TESTS
from knittest.runs.specimen import prepare, run_specimen
from knittest.solve.state import Observer


class Seen(Observer):
    """Keeps the phases and the shares of each."""

    def __init__(self):
        self.phases = {}

    def phase(self, text):
        self.phases[text] = []

    def relaxation_progress(self, fraction):
        self.phases[list(self.phases)[-1]].append(fraction)

    def progress(self, fraction, time_ms, step_us, kinetic_ratio):
        self.phases[list(self.phases)[-1]].append(fraction)


def test_a_strip_of_yarns_comes_to_rest_before_its_test():
    sets = ["rig.width=10", "rig.gauge_length=10", "output.frames=1"]
    run, seen = resolve(variant="2", scale="meso", preset="quick", direction="warp", sets=sets), Seen()
    run_specimen(run, observer=seen)
    rest, test = (seen.phases[name] for name in ("relaxing the specimen before the test", "running the test"))
    assert len(rest) > 10 and rest == sorted(rest) and 0.0 < rest[-1] <= 1.0
    assert len(test) > 10


def test_a_cell_keeps_no_row_of_its_rest():
    sets = ["rig.path=shear", "solver.speed=20", "rig.end_angle=4"]
    run, seen = resolve(test="cell", variant="2", preset="quick", sets=sets), Seen()
    prepared = prepare(run)
    assert prepared.model.prestressed
    history, _ = TESTS["cell"].solve(prepared, run, seen)
    assert len(seen.phases["relaxing the specimen before the test"]) > 10
    assert len(prepared.model.record) == len(history.energies["time_ms"]) == len(seen.phases["running the test"])
