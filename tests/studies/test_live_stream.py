"""The loop of `studies/live_stream.py` over a short stream."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from study_modules import study

import bayestouch


def test_the_loop_reads_every_touch_and_draws(tmp_path: Path) -> None:
    module = study("live_stream")
    out = module.main(["-o", str(tmp_path / "frames"), "--touches", "2"])
    assert len(out["seconds"]) == 2 * module.SAMPLES
    assert len(list((tmp_path / "frames").glob("*.png"))) == out["frames"] == 6
    # The last posterior of a touch is that of the mean of its samples.
    data, calibration = module.sensor()
    rows = list(module.stream(data, calibration.noise, 2))[: module.SAMPLES]
    values = np.mean([each.values for each in rows], axis=0)
    load = float(np.mean([each.load for each in rows]))
    whole = bayestouch.Reader(calibration).read(values, load, reads=len(rows))
    np.testing.assert_allclose((out["last"][0].mean - whole.mean) / whole.sd, 0.0, atol=5e-3)
