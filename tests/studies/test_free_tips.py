"""The radius of a tip of Table 3 as an unknown."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
import study_modules  # noqa: F401  # it makes nicolson_fearing known
from nicolson_fearing import free_tips
from nicolson_fearing.free_tips import FreeTips
from nicolson_fearing.published_fits import BiasCurves, infer_from_table_3
from nicolson_fearing.simulated_fits import HERTZ, WidthModel
from nicolson_fearing.table_3_effects import CONTACTS, LAYER, TRUTH, squeezed
from nicolson_fearing.table_3_residual import squeeze_of_layer
from nicolson_fearing.table_3_widths import squeeze_of_s_map
from nicolson_fearing.width_laws import BY_FACTOR, CONSTANT, EXACT, LAWS, NarrowerLayer, WidthLaw
from study_modules import is_drawn, study

TIP, OTHER = 2, 6


@lru_cache(maxsize=1)
def free() -> FreeTips:
    made = FreeTips.simulated(small=True)
    return replace(made, law=WidthLaw("one", squeezed, {"squeeze": (0.33,)}))


def table_of(tips_mm: list[float], reader: WidthModel | None = None) -> np.ndarray:
    """Table 3 as simulated with these tips in its rows, which are all among those simulated; nothing interpolated."""
    rows = np.searchsorted(free().tips_mm, tips_mm)
    curves = BiasCurves.of(free().many, (HERTZ, reader or squeezed(0.33)))
    return np.asarray(curves.means(0.057)[..., rows])


@pytest.mark.slow
@pytest.mark.parametrize(("true", "rows"), [(BY_FACTOR, (0.83, 0.87, 0.91)), (CONSTANT, (0.23, 0.33, 0.43))])
def test_the_law_by_which_widths_were_made_is_found(
    true: WidthLaw, rows: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    middle = rows[1]
    made = table_of(list(free_tips.TIPS_MM), true.model(middle))
    monkeypatch.setattr(free_tips, "table_3", lambda: made)
    (name,) = true.grids
    found = replace(free(), law=replace(true, grids={name: rows})).posterior()
    assert found.of_law[0][0] == pytest.approx(middle, abs=0.3 * (rows[2] - middle))
    assert np.abs(found.residual_mm).max() < 0.1
    exact = replace(free(), law=EXACT).posterior()
    assert found.log_evidence > exact.log_evidence + 3 and exact.of_law == ()


@pytest.mark.slow
def test_the_study_of_laws_says_and_draws_what_it_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = study("nicolson_fearing/table_3_widths")
    made = replace(free(), law=CONSTANT)
    monkeypatch.setattr(module.FreeTips, "simulated", lambda small: made)
    found = module.main(True, tmp_path)
    assert set(found.laws) == {EXACT.name, CONSTANT.name}
    exact, constant = (found.laws[law.name] for law in (EXACT, CONSTANT))
    text = module.tables(found)
    for i in range(2):  # evidence over that of a constant, with the tip of 3.90 mm as printed and free
        assert f"{exact[i].log_evidence - constant[i].log_evidence:+.1f}" in text
    assert "squeeze (mm)" in text and "| 25.25 |" in text
    assert is_drawn(tmp_path / "table_3_widths.png")


def test_a_narrower_layer_is_narrower_by_what_is_said() -> None:
    kappa = np.array([0.0, 0.1, 5.0, 20.0])
    plain = LAYER.half_width(kappa)
    assert NarrowerLayer(0.2).half_width(kappa) == pytest.approx(np.maximum(plain - 0.2, 0.0))
    both = LAWS[3]
    assert both.values.shape == (81, 2) and len(both.models()) == 81
    assert both.models()[0].half_width(kappa) == pytest.approx(0.8 * HERTZ.half_width(kappa))


@pytest.mark.parametrize("modulus", [0.06, 0.12])
def test_an_s_map_with_many_coefficients_has_the_widths_of_the_layer(modulus: float) -> None:
    seen = squeeze_of_s_map(71, modulus)
    resolved = np.isfinite(seen)
    expected = squeeze_of_layer(modulus, TRUTH)
    assert np.abs(seen - expected)[resolved].max() < 0.03 and resolved.sum() >= 7  # n_c β is 10 or more: 1.5 % of load
    assert np.isnan(squeeze_of_s_map(20, modulus)[0])


def test_without_free_tips_the_evidence_is_that_of_table_3_residual() -> None:
    ours = free().posterior()
    curves = BiasCurves.of(free().base, (HERTZ, squeezed(0.33)))
    means = BiasCurves.of(free().many, (HERTZ, squeezed(0.33)))
    rows = np.searchsorted(free().tips_mm, free_tips.TIPS_MM)
    theirs = infer_from_table_3(
        BiasCurves(means.moduli_MPa, means.tables[..., rows], means.location_sd, means.elements),
        contacts=CONTACTS,
        covariance_of=curves,
    )
    # a grid of μ of half as many points
    assert ours.log_evidence == pytest.approx(theirs.log_evidence, abs=0.02)
    assert ours.modulus_MPa[0] == pytest.approx(theirs.mean_MPa, rel=0.02)


def test_a_tip_of_another_radius_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Table 3 as simulated, but with a tip of 2.4 mm in the row of 3.90 mm."""
    true = 2.4
    tips = list(free_tips.TIPS_MM)
    tips[TIP] = true
    made = table_of(tips)
    monkeypatch.setattr(free_tips, "table_3", lambda: made)
    as_printed = free().posterior()
    found = free().posterior((TIP,), [free().between(TIP)])
    mean, low, high = found.radius_mm(0)
    assert low < true < high
    assert mean == pytest.approx(true, abs=0.15)
    assert found.log_evidence > as_printed.log_evidence + 5
    assert np.abs(found.residual_mm).max() < 0.05
    assert free().wanted_mm(TIP, found) == pytest.approx(true, abs=0.05)
    # another tip, made as printed, gains nothing by being free and is found where it is
    other = free().posterior((OTHER,), [free().between(OTHER)])
    assert other.log_evidence < as_printed.log_evidence + 0.5
    low, high = other.radius_mm(0)[1:]
    assert low < free_tips.TIPS_MM[OTHER] < high
