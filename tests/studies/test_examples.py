"""The examples of other samplers on the density of a calibration."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "studies" / "examples"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["plain_emcee", "dynesty_calibration"])
def test_another_sampler_draws_the_same_calibration(name: str) -> None:
    """Means and sds of three parameters: of 1,000 or more draws, and of 4,000 of `calibrate`.

    An sd of an effective size of 600 is good to 3 %, a mean to 0.04 sd; three times that is allowed.
    """
    if name == "dynesty_calibration":
        pytest.importorskip("dynesty", reason="dynesty is not installed: pip install dynesty")
    for parameter, (off, ratio) in runpy.run_path(str(EXAMPLES / f"{name}.py"))["main"]().items():
        assert abs(off) < 0.13, parameter
        assert ratio == pytest.approx(1, abs=0.09), parameter
