"""Error of the kernel beside effects: the scatter that was put into the readings is found, per element."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pad_simulation import line

from bayestouch.model.split_data import SplitData
from bayestouch.pad.beginning import begin

T, SAMPLES = 400, 4


def test_the_error_of_each_element_is_what_noise_does_not_explain() -> None:
    """Errors that are equal in all samples of a touch, of another size for each element."""
    sizes = np.array([0.2, 0.4, 0.0, 0.3])
    pad, rng = line(floor=0.05, share=0.0), np.random.default_rng(5)
    place = rng.uniform(6, 32, T)[:, None]
    table = pad.touch(place, rng, load=rng.uniform(0.8, 1.2, T), measured=True, samples=SAMPLES)
    errors = sizes * rng.standard_normal((T, 4))
    table = table.with_(readings=table.readings + np.repeat(errors, SAMPLES, axis=0))
    data = replace(pad.dataset(table), sensor=replace(pad.sensor, force_noise_sd=1e-4))
    begun = begin(SplitData.of_calibration(data), kernel="gaussian", draws=8, seed=0, e_map="model")
    noise = begun.fitted.noise
    assert noise.lasting is not None
    # 400 touches know a sd to 3.5 %: four times that. Below it is a tenth of the noise of a mean, 0.05 / 2.
    np.testing.assert_allclose(noise.lasting.discrepancy_sd, sizes, rtol=0.14, atol=0.0125)
    # Chi-square of 1,600 readings less 13 unknowns: relative sd sqrt(2 / 1600), four times that.
    assert abs(begun.fitted.chi_square() / (T * 4 - 13) - 1) < 0.14
    with_map = begin(SplitData.of_calibration(data), kernel="gaussian", draws=8, seed=0)
    assert with_map.fitted.noise.lasting is None and not with_map.no_correction
