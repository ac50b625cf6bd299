"""Results beside the experiment as a person reads them: labels, digits, deviation, kind and verdict."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

#: label and format of a result
LABELS = {
    "peak_force_n": ("peak force [N]", "{:.0f}"),
    "fracture_strain_pct": ("fracture strain [%]", "{:.2f}"),
    "peak_force_n_per_mm": ("peak force per width [N/mm]", "{:.1f}"),
    "force_per_yarn_n": ("force per yarn [N]", "{:.1f}"),
    "pull_force_kinetic_n": ("pull force, kinetic [N]", "{:.1f}"),
    "pull_force_static_n": ("pull force, largest [N]", "{:.1f}"),
    "mu_paper": ("F_R/F_N, two faces [-]", "{:.4f}"),
    "mu_per_face": ("F_R/(2 F_N), a face [-]", "{:.4f}"),
    "normal_force_n": ("normal force [N]", "{:.1f}"),
    "normal_force_error_pct": ("largest normal force error [%]", "{:.2f}"),
    "compression_mm": ("plates closed by [mm]", "{:.3f}"),
    "pressure_mean_mpa": ("mean pressure [MPa]", "{:.3f}"),
    "pressure_peak_mpa": ("largest pressure of a cell [MPa]", "{:.2f}"),
    "plate_load_on_warp_pct": ("plates' load on warp yarns [%]", "{:.1f}"),
    "plate_load_on_weft_pct": ("plates' load on weft yarns [%]", "{:.1f}"),
    "plate_load_on_knit_pct": ("plates' load on loops [%]", "{:.1f}"),
    "plate_penetration_um": ("deepest penetration of a plate [um]", "{:.2f}"),
    "element_deformation_um": ("largest deformation of an element [um]", "{:.1f}"),
    "penetration_over_deformation_pct": ("penetration over deformation [%]", "{:.1f}"),
    "chord_angle_deg": ("chord angle [deg]", "{:.2f}"),
    "overhang_mm": ("overhang [mm]", "{:.1f}"),
    "bending_stiffness_mncm2": ("B by Eq. 2, of the strip [mN cm2]", "{:.0f}"),
    "bending_stiffness_n_mm_per_width": ("B, root moment/curvature [N mm]", "{:.2f}"),
    "moment_error_pct": ("root moment off weight [%]", "{:.2f}"),
    "residual": ("out of balance, of the weight", "{:.2g}"),
    "curl_moment_nmm": ("curl of the loops, held [N mm]", "{:.3f}"),
    "drift_deg": ("chord drift by the last turn [deg]", "{:.2f}"),
    "shear_force_n_at_deg.10": ("shear force at 10 deg [N]", "{:.2f}"),
    "shear_force_n_at_deg.20": ("shear force at 20 deg [N]", "{:.2f}"),
    "shear_force_n_at_deg.30": ("shear force at 30 deg [N]", "{:.2f}"),
    "shear_force_n_at_deg.40": ("shear force at 40 deg [N]", "{:.2f}"),
    "normalised_shear_force_n_per_mm_at_deg.10": ("normalised shear force at 10 deg [N/mm]", "{:.4f}"),
    "normalised_shear_force_n_per_mm_at_deg.20": ("normalised shear force at 20 deg [N/mm]", "{:.4f}"),
    "normalised_shear_force_n_per_mm_at_deg.30": ("normalised shear force at 30 deg [N/mm]", "{:.4f}"),
    "normalised_shear_force_n_per_mm_at_deg.40": ("normalised shear force at 40 deg [N/mm]", "{:.4f}"),
    "material_shear_angle_deg_at_40deg": ("material shear at 40 deg, mean [deg]", "{:.2f}"),
    "material_shear_angle_sd_deg_at_40deg": ("material shear at 40 deg, sd [deg]", "{:.2f}"),
    "wrinkle_onset_deg": ("wrinkle onset [deg]", "{:.1f}"),
    "wrinkle_amplitude_mm_at_40deg": ("wrinkle amplitude at 40 deg [mm]", "{:.2f}"),
    "wrinkle_count_at_40deg": ("wrinkles at 40 deg", "{:.0f}"),
    "stamp_force_max_n": ("stamp force, largest [N]", "{:.1f}"),
    "max_shear_angle_deg": ("shear angle, largest [deg]", "{:.1f}"),
    "max_wrinkle_height_mm": ("wrinkle of the flange, largest [mm]", "{:.2f}"),
    "wrinkled_area_pct": ("flange above half the thickness [%]", "{:.1f}"),
    "draw_in_max_mm": ("draw-in, largest [mm]", "{:.1f}"),
    "max_yarn_force_n": ("yarn force, largest [N]", "{:.2f}"),
    "max_yarn_utilisation_pct": ("yarn force over strength [%]", "{:.2f}"),
    "yarns_at_risk": ("yarns at risk", "{:.0f}"),
    "shear_angle_p95_deg": ("shear angle, 95th percentile [deg]", "{:.1f}"),
    "shear_angle_inner_corners_p95_deg": ("same, at the inner corners [deg]", "{:.1f}"),
    "shear_angle_elsewhere_p95_deg": ("same, elsewhere [deg]", "{:.1f}"),
    "wrinkle_height_p95_mm": ("wrinkle of the flange, 95th percentile [mm]", "{:.2f}"),
    "rim_wave_height_mm": ("wave of the rim, crest over trough, largest [mm]", "{:.2f}"),
    "rim_wave_count": ("waves of the rim", "{:.0f}"),
    "off_stamp_area_pct": ("bottom off the stamp by half the thickness [%]", "{:.1f}"),
    "draw_in_warp_mm": ("draw-in, warp ends, middle [mm]", "{:.1f}"),
    "draw_in_weft_mm": ("draw-in, weft ends, middle [mm]", "{:.1f}"),
    "tool_penetration_max_um": ("deepest penetration of a tool [um]", "{:.1f}"),
    "max_membrane_strain_pct": ("strain of a shell, largest [%]", "{:.2f}"),
    "crossings_out_of_order": ("crossings out of order", "{:.0f}"),
}
#: results that grow with the specimen, and the same as no size enters it
SIZED = {"peak_force_n": "peak_force_n_per_mm"} | {
    f"shear_force_n_at_deg.{a}": f"normalised_shear_force_n_per_mm_at_deg.{a}" for a in (10, 20, 30, 40)
}
#: what a kind of row is worth
KINDS = {
    "tuned": "tuned: a parameter was fitted to this row, or chosen with it in view: it proves nothing by itself",
    "input": "input: the model was given this row and returns it",
    "assumed": "assumed: what decides this row was assumed, or taken over from another fabric: it proves nothing",
}
#: what decides a row and is assumed
ON_ASSUMED = "on {} assumed input{}"


#: verdict on a result whose numerical error reaches across the border
UNRESOLVED = "unresolved: the numerical error crosses 1 sd"
#: verdict where the experiment states no scatter, as of one specimen
UNSCATTERED = "sd not stated"
#: verdict on a number that the run was given as such
GIVEN = "given"
#: specimens of an ensemble up to which each is shown beside the mean
SIDE_BY_SIDE = 2


def folded(results: Mapping[str, Any]) -> dict[str, Any]:
    """Results as summary.json has them: ``name.key`` becomes the map ``name`` with ``key``."""
    whole: dict[str, Any] = {}
    for quantity, value in results.items():
        name, dot, key = quantity.partition(".")
        if dot:
            whole.setdefault(name, {})[key] = value
        else:
            whole[name] = value
    return whole


def unfolded(results: Mapping[str, Any]) -> dict[str, Any]:
    """The inverse of :func:`folded`: a number, or the mean, sd and values of an ensemble, for each ``name.key``."""
    flat: dict[str, Any] = {}
    for name, value in results.items():
        if isinstance(value, Mapping) and "values" not in value:
            flat |= {f"{name}.{key}": inner for key, inner in value.items()}
        else:
            flat[name] = value
    return flat


@dataclass(frozen=True)
class ResultRow:
    """One result as text, "-" where there is nothing; ``value`` is the number, the mean of an ensemble.

    ``assumed`` are the fields that decide a compared row and that are assumed; ``error`` is the numerical error, where
    it was estimated.
    """

    quantity: str
    label: str
    value: float | None
    simulated: str
    experiment: str
    deviation: str
    kind: str
    verdict: str
    assumed: tuple[str, ...] = ()
    error: float | None = None

    @property
    def on_assumed(self) -> str:
        """``on 2 assumed inputs`` for a prediction that hangs on some, else empty."""
        count = len(self.assumed)
        return ON_ASSUMED.format(count, "s" * (count > 1)) if self.kind == "predicted" and count else ""

    @property
    def kind_told(self) -> str:
        """The kind, and of a prediction the number of assumed inputs that decide it."""
        return f"{self.kind}, {self.on_assumed}" if self.on_assumed else self.kind


def result_rows(summary: Mapping[str, Any], plus_minus: str = "±", *, refused: bool) -> list[ResultRow]:
    """One row a result of ``summary`` (summary.json); those of a ``refused`` run are compared with nothing."""
    compared = {row["quantity"]: row for row in summary["comparison"]}
    errors = summary.get("numerical_error") or {}
    rows = []
    for quantity, value in unfolded(summary["results"]).items():
        label, form = LABELS.get(quantity, (quantity.replace("_", " "), "{:.4g}"))
        error = errors.get(quantity, {}).get("error")
        tail = _judged(compared.get(quantity), form, plus_minus, error, refused=refused)
        if errors and error is None and tail[-1].endswith("1 sd"):
            tail = (*tail[:-1], f"{tail[-1]}, numerical error not known")
        number = value["mean"] if isinstance(value, Mapping) else value
        guessed = tuple((compared.get(quantity) or {}).get("assumed") or ())
        rows.append(
            ResultRow(quantity, label, number, _simulated(value, form, plus_minus, error), *tail, guessed, error)
        )
    return rows


def error_text(error: float, form: str) -> str:
    """An error in the format of its result, with two digits of its own where that would show none."""
    text = form.format(error)
    return f"{error:.2g}" if error > 0.0 and float(text) == 0.0 else text


def _simulated(value: Any, form: str, plus_minus: str, error: float | None = None) -> str:
    """A number with its numerical ``error``; of an ensemble mean, sd and count, and the values of a small one side by
    side.
    """
    if isinstance(value, Mapping):
        mean, sd, count = _number(value["mean"], form), _number(value["sd"], form), len(value["values"])
        each = ": " + ", ".join(_number(v, form) for v in value["values"]) if count <= SIDE_BY_SIDE else ""
        told = "" if error is None else f", numerical {plus_minus} {error_text(error, form)}"
        return f"{mean} {plus_minus} {sd} (n {count}{each}){told}"
    return _number(value, form) + ("" if error is None else f" {plus_minus} {error_text(error, form)}")


def _judged(
    row: Mapping[str, Any] | None, form: str, plus_minus: str, error: float | None, *, refused: bool
) -> tuple[str, str, str, str]:
    """Experiment, deviation, kind and verdict of one row."""
    if refused:
        return "-", "-", "-", "refused"
    if row is None:
        return "-", "-", "-", "no reference"
    mean, deviation = _number(row["experiment_mean"], form), row["deviation_sd"]
    scaled = f" ({row['scaled']})" if row.get("scaled") else ""
    if row.get("given"):
        return _experiment(row, form, plus_minus) + scaled, "-", row["kind"], GIVEN
    if deviation is None or not math.isfinite(deviation):
        percent = _percent(row.get("simulated"), row["experiment_mean"], error, plus_minus)
        return mean + scaled, percent or "-", row["kind"], UNSCATTERED if percent else "not comparable"
    share = 0.0 if error is None else error / row["experiment_sd"]
    told = "" if error is None else f" {plus_minus} {error_text(share, '{:.2f}')}"
    # what the model was given says nothing of the model, wherever its error reaches
    verdict = verdict_of(deviation, 0.0 if row["kind"] == "input" else share)
    return _experiment(row, form, plus_minus) + scaled, f"{deviation:+.2f}{told} sd", row["kind"], verdict


def _experiment(row: Mapping[str, Any], form: str, plus_minus: str) -> str:
    """Mean and sd of the experiment; the mean alone where no sd is stated."""
    sd = row.get("experiment_sd")
    scatter = f" {plus_minus} {_number(sd, form)}" if sd and math.isfinite(sd) else ""
    return _number(row["experiment_mean"], form) + scatter


def verdict_of(deviation: float, error: float = 0.0) -> str:
    """Verdict: within or outside one sd of the experiment, wherever in its numerical ``error`` (both in sd) it is."""
    if abs(deviation) + error <= 1.0:
        return "within 1 sd"
    return "outside 1 sd" if abs(deviation) - error > 1.0 else UNRESOLVED


def _percent(simulated: float | None, mean: float | None, error: float | None, plus_minus: str) -> str:
    """Deviation with its numerical ``error`` in percent of the mean; empty where one of the two is no number."""
    if simulated is None or not mean or not math.isfinite(simulated / mean):
        return ""
    told = "" if error is None else f" {plus_minus} {error_text(abs(100.0 * error / mean), '{:.1f}')}"
    return f"{100.0 * (simulated / mean - 1.0):+.1f}{told} %"


def _number(value: float | None, form: str) -> str:
    return form.format(value) if value is not None and math.isfinite(value) else "-"
