"""Touches on a finger with effects take the same way as those on one without."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from streamed_cases import blocks_of_seven, same

import bayestouch
from bayestouch.data import tables, touch_source
from bayestouch.data.touch_table import read_touches, write_touches
from bayestouch.effects.stated import StatedModel
from bayestouch.finger.reading.effects import EffectContext
from bayestouch.finger.reading.touch_reader import FingerTouchReader
from bayestouch.reading.faults import SensorCheck
from bayestouch.reading.options import Options
from bayestouch.reporting.residuals import standardised

OPTIONS = {"draws": 64, "seed": 5, "method": "importance"}


@cache
def finger(effect: str | None) -> tuple[bayestouch.DataSet, bayestouch.Calibration]:
    """A finger without effects, calibrated with one, or with none."""
    design = bayestouch.FingerDesign(n_elements=7, edge_step_deg=4.0, flat_step_deg=8.0, touch_step_deg=8.0)
    data = bayestouch.simulate(design, seed=3).dataset
    effects = () if effect is None else ((effect, {}),)
    return data, bayestouch.calibrate(data, model=StatedModel("finger", "hertz", effects), draws=64, seed=1)


@pytest.mark.parametrize(
    ("effect", "whole"),
    [
        ("crosstalk", False),
        ("creep", True),
        ("load_offset", True),
        ("load_misalignment", True),
        ("prober_eccentricity", False),
        ("baseline_drift", True),
    ],
)
def test_the_whole_table_is_needed_where_other_touches_matter(effect: str, whole: bool) -> None:
    assert FingerTouchReader.from_calibration(finger(effect)[1], Options()).needs_whole_table == whole


@pytest.mark.parametrize("effect", ["crosstalk", "creep"])
def test_a_file_in_pieces_is_read_like_one_in_memory(
    effect: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data, calibration = finger(effect)
    path = tmp_path / "touches.csv"
    write_touches(data.touches, path, data.sensor)
    blocks_of_seven(monkeypatch)
    whole = bayestouch.infer(read_touches(path, data.sensor), calibration, **OPTIONS)  # type: ignore[arg-type]
    monkeypatch.setattr(tables, "CHUNK", 53)
    monkeypatch.setattr(touch_source, "READ_WHOLE", 0)
    assert len(list(touch_source.source_of(path, data.sensor).pieces())) > 5
    same(bayestouch.infer(path, calibration, **OPTIONS), whole)  # type: ignore[arg-type]
    same(bayestouch.infer(path, calibration, output=tmp_path / "a.nc", **OPTIONS), whole)  # type: ignore[arg-type]


@pytest.mark.parametrize("effect", [None, "crosstalk"])
def test_single_samples_keep_the_numbers_of_their_touch_and_sample(effect: str | None, tmp_path: Path) -> None:
    """In any order of rows, in the result, its file and its table."""
    data, calibration = finger(effect)
    some = np.unique(data.touches.touch)[:6]
    touches = data.touches.select(np.isin(data.touches.touch, some) & data.touches.in_contact)
    touches = touches.with_(touch=touches.touch + 100).select(np.random.default_rng(0).permutation(touches.n_rows))
    read = bayestouch.infer(touches, calibration, each_sample=True, **OPTIONS)  # type: ignore[arg-type]
    read.save(tmp_path / "samples.nc")
    for made in (read, bayestouch.load(tmp_path / "samples.nc")):
        assert isinstance(made, bayestouch.TouchPosteriors)
        np.testing.assert_array_equal(made.rows.touch, touches.touch)
        np.testing.assert_array_equal(made.rows.sample, touches.sample)
        np.testing.assert_array_equal(made[3:5].to_arviz().posterior["sample"], touches.sample[3:5])
        first = made.to_dataframe()[: touches.n_rows]
        np.testing.assert_array_equal(first[["touch", "sample"]], np.stack([touches.touch, touches.sample], axis=1))
    whole = bayestouch.infer(touches, calibration, **OPTIONS)  # type: ignore[arg-type]
    assert whole.rows.sample is None and "sample" not in whole.to_dataframe()


@pytest.mark.slow
def test_blocks_that_were_cut_and_joined_have_the_effects_of_each_touch() -> None:
    data, calibration = finger("memory")
    reader = FingerTouchReader.from_calibration(calibration, Options())
    block = reader.ready(reader.average(data.touches))
    context = block.readings.context
    assert isinstance(context, EffectContext)
    assert np.ptp(context.shift, axis=0).min() > 0, "what is remembered is not the same at every touch"
    cut = [block.select(index) for index in (np.arange(3), np.arange(3, block.n_touches))]
    joined = type(block).joined(cut).readings.context
    for name in ("scale", "shift", "extra", "counts", "slopes"):
        np.testing.assert_array_equal(getattr(joined, name), getattr(context, name))


def test_the_check_counts_the_uncertainty_of_a_calibration_that_counts_as_exact() -> None:
    """Also where the calibration has effects: a sound sensor misfits by as much."""
    data, calibration = finger("crosstalk")
    some = np.arange(5)
    touch = np.full(5, 3.0), np.linspace(-0.3, 0.3, 5), np.full(5, 200.0)
    found = []
    for plug_in in (False, True):
        reader = FingerTouchReader.from_calibration(calibration, Options(plug_in=plug_in))
        means = reader.average(data.touches)
        found.append(reader.fitted(means, reader.ready(means), some).reading_covariance(*touch))
    assert np.einsum("tii->ti", found[0]).min() > 0
    np.testing.assert_allclose(found[1], found[0])


def test_a_misfit_widens_the_noise_of_effects_too() -> None:
    """By three: nine times the covariance of the noise that elements share."""
    data, calibration = finger("common_mode_noise")
    touch = np.full(5, 3.0), np.linspace(-0.3, 0.3, 5), np.full(5, 200.0)
    found = []
    for excess in (1.0, 3.0):
        reader = FingerTouchReader.from_calibration(calibration, Options(plug_in=True))
        reader = reader.without(SensorCheck((), np.arange(7), excess, 50))
        context = reader.ready(reader.average(data.touches)).select(np.arange(5)).readings.context
        assert context is not None
        found.append(context.covariance(*touch))
    assert found[0].min() > 0
    np.testing.assert_allclose(found[1], 9 * found[0])


@pytest.mark.parametrize(("effect", "size"), [("signal_dependent_noise", 0.05), ("common_mode_noise", 0.03)])
def test_residuals_are_compared_with_the_noise_of_effects(effect: str, size: float) -> None:
    """The root mean square of standardised residuals of a right model is about 1, in `infer` and the calibration.

    Without the noise of the effect it is above 3.
    """
    design = bayestouch.FingerDesign(
        n_elements=5,
        calibration_span_deg=30.0,
        edge_step_deg=2.0,
        flat_step_deg=5.0,
        touch_step_deg=4.0,
        noise_percent_peak=0.5,
        samples_per_touch=5,
    )
    data = bayestouch.simulate(design, effects={effect: size}, seed=0).dataset
    model = StatedModel("finger", "layer", ((effect, {}),))
    calibration = bayestouch.calibrate(data, model=model, draws=100, seed=1)
    read = bayestouch.infer(data.touches, calibration, **OPTIONS)  # type: ignore[arg-type]
    for rows in (calibration.rows, read.rows):
        assert 0.6 < np.sqrt(np.nanmean(standardised(rows) ** 2)) < 1.2
