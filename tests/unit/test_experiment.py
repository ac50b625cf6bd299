"""Published tables and curves as they ship."""

import numpy as np
import pytest

from knittest.base.errors import InputError
from knittest.base.files import data_dir
from knittest.experiment.curves import load_curve
from knittest.experiment.reconstruct import CASES, curve, text
from knittest.experiment.statistics import Specimen, mean_curve, tension_curve
from knittest.experiment.tables import published


def test_table_3_is_read_with_its_scatter():
    peak, strain = published(data_dir() / "pham2019", "2", "weft")
    assert (peak.mean, peak.sd, peak.n, peak.table) == (7332.0, 380.0, 10, "Table 3")
    assert (strain.mean, strain.sd) == (1.6, 0.2)


@pytest.mark.parametrize("case", CASES)
def test_shipped_curves_are_what_the_generator_writes(case):
    path = data_dir() / "pham2019" / "curves" / f"tensile-v{case[0]}-{case[1]}.csv"
    assert path.read_text(encoding="utf-8") == text(*case)
    loaded = load_curve(path)
    assert loaded.kind == "reconstructed"
    assert loaded.sd is None


@pytest.mark.parametrize("case", CASES)
def test_reconstructed_curve_ends_at_the_published_point_and_rises(case):
    strain, force = curve(*case)
    peak, end = published(data_dir() / "pham2019", *case)
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
