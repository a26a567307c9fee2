"""Made-up calibrations and posteriors of touches."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from bayestouch.chain.noise import Noise
from bayestouch.data.sensor import Finger, Pad, Rubber, Sensor
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Uniform
from bayestouch.results.data import TouchRows
from bayestouch.results.objects import Calibration, TouchPosteriors

FINGER = Sensor(
    name="fingér",
    body=Finger(9.5, 12.7, 10.6, (-30.0, -10.0, 10.0)),
    rubber=Rubber(0.2, None),
    force_noise_sd=0.7,
    reading_unit="counts",
    reading_quantity="capacitance",
    source={"paper": "Nicolson and Fearing\n1995"},
    extra={"bench": {"operator": "µ", "table": [1, 2.5]}},
    notes=("sensor.toml: bench is not known here, kept and not used",),
)


PAD = Sensor(name="pad", body=Pad((0.0, 4.0, 0.0), (0.0, 0.0, 4.0), 5.0, 2.0))


PARAMETERS = (
    Parameter("sigma", "σ", r"\sigma", "", Normal(0.45, 0.05, 0.0, 0.5), "Poisson's ratio"),
    Parameter("mu", "μ", r"\mu", "MPa", LogNormal(0.2, 0.5)),
    Parameter("r_s", "r_s", "r_s", "mm", Uniform(9.6, 12.6)),
)


TOUCH_PARAMETERS = (
    Parameter("R", "R", "R", "mm", Uniform(0.0, 12.7)),
    Parameter("theta_c", "θ_c", r"\theta_c", "degree", Uniform(-50.0, 50.0)),
    Parameter("P", "P", "P", "N/m", Uniform(0.0, 600.0)),
)


def _rows(t: int, m: int, *axes: str) -> TouchRows:
    rng = np.random.default_rng(t)
    observed = rng.normal(size=(t, m))
    observed[0, 0] = np.nan
    return TouchRows(
        touch=np.arange(t)[::-1] * 2,
        location={axis: rng.normal(size=t) for axis in axes},
        radius_mm=np.resize([0.0, np.inf, np.nan, 3.2], t),
        load=np.resize([400.0, np.nan], t),
        observed=observed,
        predicted=rng.normal(size=(t, m)),
        sd=np.full((t, m), 0.1),
        counts=rng.integers(0, 20, size=(t, m)),
        samples=np.full(t, 21.0),
        load_reads=np.resize([21.0, 1.0], t),
    )


def calibration() -> Calibration:
    rng = np.random.default_rng(1)
    shapes = {"sigma": (), "mu": (), "r_s": (3,), "gain": (3,), "theta_s": (3,)}
    return Calibration(
        sensor=FINGER,
        parameters=PARAMETERS,
        mode={name: rng.normal(size=shape) for name, shape in shapes.items()},
        posterior={name: rng.normal(size=(4, 25, *shape)) for name, shape in shapes.items()},
        covariance=np.cov(rng.normal(size=(5, 20))),
        layout=("sigma", "mu", "r_s[0]", "r_s[1]", "r_s[2]"),
        noise=Noise(np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.01, 0.0]), 0.02, np.nan),
        rows=_rows(6, 3, "theta_c"),
        settings={"contact": "layer", "seed": 3.0, "samples": np.float64(5), "typical_load": np.inf},
        statistics={"lack_of_fit": 1.25, "error_percent_peak": np.nan},
        extra={"rest_reading": np.array([1.0, np.nan, 3.0]), "map": rng.normal(size=(2, 5)), "scale": np.array(2.0)},
        notes=("one", "two: “θ”"),
    )


def touches(sensor: Sensor = FINGER) -> TouchPosteriors:
    rng = np.random.default_rng(2)
    names = ("r_c", "R", "theta_c", "P") if isinstance(sensor.body, Finger) else ("x", "y", "P")
    axes = ("theta_c",) if isinstance(sensor.body, Finger) else ("x", "y")
    return TouchPosteriors(
        sensor=sensor,
        parameters=TOUCH_PARAMETERS if isinstance(sensor.body, Finger) else (),
        posterior={name: rng.normal(size=(4, 50, 5)) for name in names},
        sample_stats={name: rng.normal(size=5) for name in ("ess_bulk", "rhat", "acceptance")},
        reference={name: np.array([1.0, np.nan, np.inf, 0.0, 2.0]) for name in names},
        rows=_rows(5, 3, *axes),
        settings={"plug_in": 0.0},
        notes=(),
    )


def same(first: Any, second: Any) -> None:
    """Equal to the last bit, NaN included, with the same types of arrays."""
    if isinstance(first, np.ndarray):
        assert isinstance(second, np.ndarray) and first.dtype == second.dtype
        np.testing.assert_array_equal(first, second)
    elif is_dataclass(first) and not isinstance(first, type):
        assert type(first) is type(second)
        for field in fields(first):
            same(getattr(first, field.name), getattr(second, field.name))
    elif isinstance(first, dict):
        assert set(first) == set(second)
        for key in first:
            same(first[key], second[key])
    elif isinstance(first, tuple | list):
        assert len(first) == len(second)
        for one, other in zip(first, second, strict=True):
            same(one, other)
    elif isinstance(first, float) and np.isnan(first):
        assert np.isnan(second)
    else:
        assert first == second
