"""Published tables and curves as they ship."""

import numpy as np
import pytest

from knittest.errors import InputError
from knittest.experiment.curves import load_curve
from knittest.experiment.reconstruct import CASES, curve, text
from knittest.experiment.tables import published
from knittest.resources import data_dir


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
        ("strain_pct,force_n\n0,0\n1,1\n", "kind"),
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
