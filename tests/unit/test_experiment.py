"""Published tables and curves as they ship; means, scatter and corridors of specimens, tested and simulated."""

from types import SimpleNamespace

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.experiment.curves import load_curve
from knittest.experiment.reconstruction import CASES, curve, text
from knittest.experiment.statistics import Specimen, corridor_on_grid, mean_curve, mean_sd, tension_curve
from knittest.experiment.tables import published_rows
from knittest.export.summary import ensemble_results
from knittest.laboratory.tensile.report import POINTS, _corridor_to_draw, corridor


def test_table_3_is_read_with_its_scatter():
    peak, strain = published_rows(data_dir() / "pham2019", "2", "weft")
    assert (peak.mean, peak.sd, peak.n, peak.table) == (7332.0, 380.0, 10, "Table 3")
    assert (strain.mean, strain.sd) == (1.6, 0.2)


@pytest.mark.parametrize("case", CASES)
def test_shipped_curves_are_what_the_generator_writes_and_end_at_the_published_point(case):
    path = data_dir() / "pham2019" / "curves" / f"tensile-v{case[0]}-{case[1]}.csv"
    assert path.read_text(encoding="utf-8") == text(*case)
    loaded = load_curve(path)
    assert loaded.kind == "reconstructed" and loaded.sd is None
    # it ends at the published point and rises
    strain, force = curve(*case)
    peak, end = published_rows(data_dir() / "pham2019", *case)
    assert (strain[0], force[0]) == (0.0, 0.0)
    assert strain[-1] == pytest.approx(end.mean)
    assert force[-1] == pytest.approx(peak.mean)
    assert (np.diff(force) / np.diff(strain) > 0).all()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("strain,force\n0,0\n1,1\n", "has no unit of strain"),
        ("a,b\n0,0\n1,1\n", "no header row names a force"),
        (
            "Dehnung [%];Kraft;Dehnung [%];Kraft\n0;0;0;0\n1;1;1;1\n",
            "2 specimens; average them with knittest data import",
        ),
        ("# kind: measured\n# peak_force_n: x\n# fracture_strain_pct: 1\nstrain_pct,force_n\n0,0\n1,1\n", "'x'"),
        ("# kind: guessed\nstrain_pct,force_n\n0,0\n1,1\n", "guessed"),
        ("# kind: measured\nstrain_pct,force_n\n0,0\n1,x\n", ":4:"),
        ("# kind: measured\nstrain_pct,force_n\n0,0\n0,1\n2,2\n", ":4: strain_pct must rise"),
        ("# kind: measured\nstrain_pct,force_n\n0,0\n", "two points"),
    ],
)
def test_bad_curves_name_file_and_line(tmp_path, content, words):
    path = tmp_path / "c.csv"
    path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=r"c\.csv") as caught:
        load_curve(path)
    assert words in str(caught.value)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252"])
def test_a_plain_curve_is_read_as_a_laboratory_writes_it_and_taken_as_measured(tmp_path, encoding):
    path = tmp_path / "c.csv"
    path.write_bytes("Prüfung\nDehnung [%];Kraft [kN]\n0,0;0,0\n0,5;1,25\n1,5;5,8\n".encode(encoding))
    loaded = load_curve(path)
    assert (loaded.kind, loaded.x_name, loaded.y_name) == ("measured", "strain_pct", "force_n")
    assert list(loaded.mean) == [0.0, 1250.0, 5800.0]
    assert loaded.peak == (1.5, 5800.0)
    assert "counts as measured" in loaded.note


def specimens():
    """Parabolas that end at 1.5 %, 5000 N and at 1.7 %, 6000 N."""
    share = np.linspace(0.0, 1.0, 50)
    return [Specimen(f"s{k}", end * share, peak * share**2) for k, (end, peak) in enumerate(((1.5, 5e3), (1.7, 6e3)))]


def test_a_mean_curve_ends_at_the_mean_peak():
    strain, force = mean_curve(specimens())
    assert (strain[-1], force[-1]) == pytest.approx((1.6, 5500.0))
    assert force == pytest.approx(5500.0 * (strain / 1.6) ** 2, abs=5500.0 * 3e-4)  # chords of 49 pieces


def test_a_tension_curve_starts_at_the_origin_and_rises_through_preload_and_noise():
    preload, rng = 20.0, np.random.default_rng(1)
    noisy = []
    for s in specimens():
        machine = np.maximum(s.force, preload) + rng.normal(0.0, 60.0, 50)
        noisy.append(Specimen(s.name, s.strain, np.append(machine[:-1], s.force[-1])))
    mean = mean_curve(noisy)[1]
    assert (np.diff(mean)[mean[1:] > 10.0 * preload] < 0.0).any()
    strain, force = tension_curve(noisy)
    assert (strain[0], force[0]) == (0.0, 0.0) and (np.diff(strain) > 0.0).all() and (np.diff(force) > 0.0).all()
    assert (strain[-1], force[-1]) == pytest.approx((1.6, 5500.0))
    assert force == pytest.approx(5500.0 * (strain / 1.6) ** 2, abs=5.0 * preload)
    assert force[1] > 2.5 * preload


def test_a_tension_curve_of_clean_data_is_the_mean_curve():
    strain, force = tension_curve(specimens())
    mean = mean_curve(specimens())
    assert strain == pytest.approx(mean[0]) and force == pytest.approx(mean[1])


#: peaks 20, 30, 40 N at 2, 3, 2.5 %: mean 30, sd 10 N with n - 1
PEAKS = ((2.0, 20.0), (3.0, 30.0), (2.5, 40.0))


def simulated() -> list[SimpleNamespace]:
    """Straight to the peak, then down."""
    curves = [{"strain_pct": np.array([0.0, x, x + 1.0]), "force_n": np.array([0.0, y, 0.0])} for x, y in PEAKS]
    return [SimpleNamespace(history=SimpleNamespace(curve=curve)) for curve in curves]


def test_the_corridor_of_simulated_specimens_has_the_sample_deviation():
    found = corridor(simulated())  # at 2 %: 20, 20, 32 N
    assert (found.n, len(found.strain), found.strain[-1]) == (3, POINTS, 2.0)
    assert found.mean[-1] == pytest.approx(24.0)
    assert found.sd[-1] == pytest.approx(np.sqrt(48.0))  # with n it were the root of 32


def test_the_peaks_of_the_picture_have_the_sample_deviation():
    peak = _corridor_to_draw(simulated()).peak
    assert (peak.strain_mean, peak.strain_sd) == pytest.approx((2.5, 0.5))
    assert (peak.force_mean, peak.force_sd) == pytest.approx((30.0, 10.0))


def test_one_specimen_has_no_scatter_to_show():
    x = np.array([0.0, 1.0])
    assert np.isnan(corridor_on_grid(x, [(x, x)]).sd).all()
    assert np.isnan(mean_sd(np.array([5.0]))[1])


def test_results_of_an_ensemble_have_the_sample_deviation():
    found = ensemble_results([{"peak_force_n": value} for value in (20.0, 30.0, 40.0)])
    assert found["peak_force_n"] == {"mean": 30.0, "sd": 10.0, "values": [20.0, 30.0, 40.0]}
