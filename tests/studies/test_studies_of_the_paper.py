"""Studies of the paper's tables and figures, run small, and their numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid
from study_modules import STUDIES, agree, is_drawn, study

from bayestouch.paper import published
from bayestouch.reliability import Beside


def test_noise_row(tmp_path: Path) -> None:
    """The paper's location row wants a modulus near 0.15 MPa, its radius row one near 0.1; and the bound is a bound."""
    results = study("nicolson_fearing/noise_row").main(1, tmp_path)
    bound, sds = results[0.15]
    assert bound[0] == pytest.approx(0.14, abs=0.01)
    assert results[0.1][0][2] == pytest.approx(0.79, abs=0.08)
    # prior and truncation can only add information: 240 touches scatter the rms sd by a few per cent
    assert np.all(sds < 1.05 * bound)
    assert is_drawn(tmp_path / "noise_row.png")


@pytest.mark.slow
def test_table_3_modulus(tmp_path: Path) -> None:
    """One soft modulus explains the Hertz columns, and predicts the rest of the paper that depends on it."""
    found = study("nicolson_fearing/table_3_modulus").main(small=True, folder=tmp_path)
    low, high = found.posterior.interval()
    assert 0.035 < low < 0.054 < high < 0.08
    # The first look of 0.5 mm; five simulated tables leave their mean uncertain by 0.05 mm.
    assert found.rms_r_c_mm["model"] == pytest.approx(0.5, abs=0.12)
    ours = {}
    for row in found.rows:
        ours.setdefault(row.key, row)  # the first of several readings is the mean over the circle
    for key in ("flat_fit.hertz", "figure_4.flat_from_edge_noise", "figure_4.r_c_over_r_b"):
        assert ours[key].low < ours[key].paper.value < ours[key].high, key
    assert ours["table_4.model.noise.R"].high < 0.6  # where it does not agree: 0.79 printed
    assert is_drawn(tmp_path / "table_3_modulus.png")


@pytest.mark.slow
def test_table_3_residual(tmp_path: Path) -> None:
    """What the authors' model squeezes explains both ends of the frictionless columns; finite strain, Table 1 alone."""
    module = study("nicolson_fearing/table_3_residual")
    found = module.main(small=True, folder=tmp_path)
    base, finite = found.effects[module.LINEAR_NAME], found.effects[module.FINITE]
    assert found.printed["hertz"] == pytest.approx(1.53, abs=0.005)  # of the printed numbers alone
    assert found.printed["frictionless"] == pytest.approx(0.53, abs=0.005)
    # The rigid core explains the Hertz columns and none of the others; three tables leave a mean uncertain by 0.1 mm.
    assert base.rms("hertz") < 0.35
    assert abs(found.rigid_core.rms("frictionless") - found.printed["frictionless"]) < 0.1
    # A squeeze does: 0.22 mm at full size without the tip that all columns read too sharp
    assert base.rms("frictionless", all_tips=False) < 0.35
    assert base.log_evidence > found.rigid_core.log_evidence + 5
    low, high = base.squeeze_mm[1:]
    assert 0.2 < low < 0.33 < high < 0.5
    assert np.all(base.residual[:, :, module.ODD_TIP] < -0.3)
    # Table 1: 10.3 mm is what edges fit to elements at 9.9 mm, if strains are finite
    assert base.fitted[1] == pytest.approx(9.9, abs=0.03)
    assert finite.fitted[1] == pytest.approx(10.4, abs=0.1)
    assert finite.log_evidence_as_designed > base.log_evidence_as_designed + 5
    assert finite.rms("frictionless") > base.rms("frictionless") - 0.05  # and Table 3 gains nothing by it
    assert (tmp_path / "table_3_residual.md").read_text("utf-8").count("\n") > 6


def test_figure_4(tmp_path: Path) -> None:
    """Both printed numbers of the figure want one modulus, if the square is averaged over the circumference."""
    module = study("nicolson_fearing/figure_4")
    rows = {row.key: row for row in module.main(small=True, folder=tmp_path)}
    by_noise, by_radius = module.modulus_for(360.0, "layer")
    # 3.7 and 0.16 are rounded: to 1.4 % and 3 %, which is 0.001 and 0.002 MPa
    assert by_noise == pytest.approx(by_radius, abs=0.005)
    for row in rows.values():
        assert row.low < row.paper.value < row.high
    assert is_drawn(tmp_path / "figure_4.png")


def by_key(rows: list[Beside]) -> dict[str, Beside]:
    """Rows by their key."""
    return {row.key: row for row in rows}


@pytest.mark.slow
def test_table_1(tmp_path: Path) -> None:
    """Flats by Hertz fit worse by what the modulus of Table 3 implies; the errors that were put in come out."""
    rows = by_key(study("nicolson_fearing/table_1").main(small=True, folder=tmp_path))
    # one finger: its errors of 16 elements, smooth over 9°, leave a mean uncertain by a tenth
    assert rows["table_1.error.avg"].ours == pytest.approx(2.16, rel=0.15)
    assert rows["flat_fit.hertz"].ours == pytest.approx(4.2, abs=0.5)
    assert rows["flat_fit.frictionless"].ours == pytest.approx(2.2, abs=0.3)
    assert rows["noise.expected_fit"].ours == pytest.approx(0.64, abs=0.05)
    assert is_drawn(tmp_path / "table_1.png")


def test_table_2(tmp_path: Path) -> None:
    """The identified map keeps the errors of places, and its elements are as well conditioned as the fitted model's."""
    rows = by_key(study("nicolson_fearing/table_2").main(small=True, folder=tmp_path))
    assert rows["table_2.error.avg"].ours == pytest.approx(1.41, abs=0.1)
    assert 1 < rows["condition_number.model"].ours < rows["condition_number.empirical"].ours < 6
    assert is_drawn(tmp_path / "table_2.png")


def test_table_3(tmp_path: Path) -> None:
    """Hertz reads blunt tips far too sharp, as printed; the approximate frictionless model does not."""
    rows = by_key(study("nicolson_fearing/table_3").main(small=True, folder=tmp_path))
    for calibration in ("model", "empirical"):
        hertz = rows[f"table_3[12.30].hertz_{calibration}"]
        # errors of places leave a mean over 40° uncertain by 0.3 mm, the modulus by 0.3 mm
        assert hertz.ours == pytest.approx(hertz.paper.value, abs=1.3)
        assert rows[f"table_3[12.30].frictionless_{calibration}"].ours == pytest.approx(12.3, abs=1.0)
    assert is_drawn(tmp_path / "table_3.png")


@pytest.mark.slow
def test_table_4(tmp_path: Path) -> None:
    """Location and noise add up to the total; averages of the empirical calibration are nearly as good as printed."""
    rows = by_key(study("nicolson_fearing/table_4").main(small=True, folder=tmp_path))
    for name in ("theta_c", "P", "R"):
        total, location, noise = (rows[f"table_4.model.{part}.{name}"].ours for part in ("total", "location", "noise"))
        # fits to samples are not linear near edge and flat
        assert np.hypot(location, noise) == pytest.approx(total, rel=0.06)
    assert rows["table_4.empirical.location.R"].ours == pytest.approx(0.6, abs=0.12)
    assert rows["radius_error.r_c_over_R"].ours == pytest.approx(4, rel=1e-3)
    assert is_drawn(tmp_path / "table_4.png")


def test_figure_2(tmp_path: Path) -> None:
    """One depth of the elements gives both cut-offs as printed."""
    rows = by_key(study("nicolson_fearing/figure_2").main(folder=tmp_path))
    assert all(rows[key].agrees for key in ("cutoff.deep", "cutoff.shallow", "rolloff.displacement"))
    assert rows["rolloff.strain_at_least"].ours > 100
    assert is_drawn(tmp_path / "figure_2.png")


def test_figure_3(tmp_path: Path) -> None:
    """All neighbours' strains differ by more than the noise up to the frequency that the paper names."""
    rows = by_key(study("nicolson_fearing/figure_3").main(folder=tmp_path))
    assert rows["figure_3.distinct_at"].agrees
    assert is_drawn(tmp_path / "figure_3.png")


def test_figure_6(tmp_path: Path) -> None:
    """The rigid core bears more load at the same width, and narrows the contact of the same load."""
    module = study("nicolson_fearing/figure_6")
    module.main(folder=tmp_path)
    for contact in module.contacts().values():
        assert contact.load_share > 1
        assert contact.hertz_width_mm > contact.width_mm
        # pressures over Hertz's peak, width over width: the area under the ellipse is π/4
        area = trapezoid(contact.layer, contact.place_mm) / (contact.width_mm * np.pi / 4)
        assert area == pytest.approx(contact.load_share, rel=5e-3)  # 480 steps, with a root at each end
    assert is_drawn(tmp_path / "figure_6.png")


def test_figures_9_and_10(tmp_path: Path) -> None:
    """The identified map fits the tails, where the elastic model is as wrong as near the element."""
    model = study("nicolson_fearing/figure_9").main(folder=tmp_path).errors_percent()
    empirical = study("nicolson_fearing/figure_10").main(folder=tmp_path).errors_percent()
    assert empirical[1] < 1.8 < model[1]
    for name in ("figure_9", "figure_10"):
        assert is_drawn(tmp_path / f"{name}.png")


def test_figure_12(tmp_path: Path) -> None:
    """Samples scatter less than the bias at many locations, and more at some than at others."""
    module = study("nicolson_fearing/figure_12")
    module.main(folder=tmp_path)
    found = module.ByLocation.of(module.paper_run(0), "model")
    assert 0.15 < found.within_bias() < 0.7
    assert found.sd.max() > 1.5 * found.sd.min()  # 20 samples leave an sd uncertain by 16 %
    assert is_drawn(tmp_path / "figure_12.png")


@pytest.mark.slow
def test_figure_13(tmp_path: Path) -> None:
    """Tips come out in order everywhere and err alike if errors belong to the place, and not if they do not repeat."""
    module = study("nicolson_fearing/figure_13")
    module.main(small=True, folder=tmp_path)
    runs = {True: module.paper_run(0), False: module.PaperRun.of(0, repeats=False)}
    radii = {repeats: module.estimates(run, "empirical")[1] for repeats, run in runs.items()}
    assert module.monotonic(radii[True]) > 0.97 > module.monotonic(radii[False])
    assert module.shared(radii[True]) > 0.7 > 0.3 > module.shared(radii[False])
    assert is_drawn(tmp_path / "figure_13.png")


@pytest.mark.slow
def test_every_published_number_has_its_own(tmp_path: Path) -> None:
    """The comparison holds them all, and most differences are those that the paper's own notes explain."""
    found = study("nicolson_fearing/compare_published").main(small=True, folder=tmp_path)
    assert len(found.rows) == len(list(published.all_numbers()))
    assert all(np.isfinite(row.ours) or row.why for row in found.rows)
    assert all(row.why for row in found.predicted if not row.agrees)
    page = (tmp_path / "published_comparison.md").read_text()
    assert page.count("| `") == len(found.rows)


@pytest.mark.slow
def test_ridge(tmp_path: Path) -> None:
    """Near the core the gain trades with depth and with σ; the response, which touches fix, does not."""
    module = study("nicolson_fearing/ridge")
    found = module.main(draws=1000, folder=tmp_path)["sparse, near the core"]
    gain, response = module.summary(found, "gain"), module.summary(found, "response")
    assert response[0] < gain[0] / 5
    assert min(abs(gain[1]), abs(gain[2])) > 0.6 > 0.4 > max(abs(response[1]), abs(response[2]))
    assert is_drawn(tmp_path / "ridge.png")


@pytest.mark.slow
def test_table_3_diagnosis(tmp_path: Path) -> None:
    """The rigid core is named first where Hertz was calibrated, and R is read without bias once it is there."""
    found = study("nicolson_fearing/table_3_diagnosis").main(small=True, folder=tmp_path)
    assert found.diagnosis.effects[0] == "rigid_core"
    share = found.diagnosis.to_dict()["effects"][0]["parameters"]["rigid_core_share"]
    # One is the contact that the tips were pressed with; four sd of the normal approximation.
    assert abs(share["mean"] - 1) < 4 * share["sd"]
    before, after = (found.diagnosis.numbers[stand]["R_bias_mm"] for stand in ("before", "after"))
    assert abs(after) < 0.5 * abs(before)
    assert is_drawn(tmp_path / "table_3_diagnosis.png")


@pytest.mark.slow
def test_the_page_of_table_3_diagnosis() -> None:
    """The page has what the study prints at full size."""
    module = study("nicolson_fearing/table_3_diagnosis")
    page = (STUDIES.parent / "docs" / "table_3_diagnosis.md").read_text("utf-8")
    assert agree(module.as_tables(module.run(small=False)), page.split(module.MARK)[1].strip())
