"""Runs of a regression that end as they are told, so that nothing has to be simulated."""

import numpy as np

from knittest.base.files import data_dir
from knittest.base.kinds import kinds
from knittest.base.result_rows import mean_factor
from knittest.experiment.tables import published_rows
from knittest.laboratory.report_base import REPORTS
from knittest.studies.trials.trial import Record

ELEMENTS, CPU_S, STEPS, ADDED = 100, 36.0, 5000, 12.5
UNPUBLISHED = {
    "forming": {"stamp_force_max_n": 109.0, "max_wrinkle_height_mm": 0.87},
    "picture-frame": {"shear_force_n_at_deg.30": 12.3, "wrinkle_amplitude_mm_at_40deg": 1.6},
    "bias-extension": {"bias_force_n_at_deg.30": 6.4},
    "biaxial": {"biaxial_force_n_per_mm": 116.0},
    "cell": {"cell_thickness_mm": 2.4},
    "compaction": {"compaction_work_j_per_m2": 122.0},
    "pull-out": {"pull_out_peak_n": 0.5},
}


class Pretending:
    """A pool whose runs return what the paper measured, or of forming and frames numbers of its own, times ``factor``,
    unless ``ends`` gives another status; ``more`` are results by the label of a trial.
    """

    def __init__(self, factor=1.0, ends=lambda trial: "completed", more=None):
        self.factor, self.ends, self.more, self.asked = factor, ends, more or {}, []

    def run(self, trials, place, limit, options, watch):
        for trial in trials:
            watch(trial, 0.0)
            self.asked.append(trial.label)
            yield self._record(trial, place(trial))

    def close(self):
        pass

    def _record(self, trial, folder):
        status = self.ends(trial)
        if status != "completed":
            return Record(trial.key, status, f"{status} with a bell \a", seconds=1.0)
        run, kind = trial.run, trial.run.rig.kind
        rows = published_rows(
            data_dir() / "pham2019", run.fabric.experiment_variant, run.direction, kinds()[kind].published
        )
        wanted = kinds()[kind].regression.rows
        results = {
            row.quantity: self.factor * row.mean / mean_factor(row.factors)
            for row in REPORTS[kind].scaled(run, rows)
            if row.quantity in wanted
        }
        results |= {name: self.factor * value for name, value in UNPUBLISHED.get(kind, {}).items()}
        results |= self.more.get(trial.label, {})
        axes = REPORTS[kind].axes
        folder.mkdir(parents=True)
        x = np.linspace(0.0, 1.6, 50)
        values = "\n".join(f"{a},{self.factor * 1000.0 * a}" for a in x)
        (folder / "curve.csv").write_text(f"{axes.x},{axes.y}\n{values}\n")
        summary = {"results": results, "refused": []} | {
            "cost": {"elements": ELEMENTS, "cpu_s": CPU_S, "steps": STEPS},
            "quality": {"added_mass_pct": ADDED},
        }
        return Record(trial.key, "completed", summary=summary, seconds=2.0)
