"""Tables of the calibration: parameters with their priors, values of each element, competing models."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.kernel_choice import kernel_names
from bayestouch.priors.parameters import Parameter
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.peak_table import error_and_noise
from bayestouch.results.objects import Calibration
from bayestouch.results.units import units_of

_SCORE, _ERROR = "log_score_", "error_percent_peak_"
_LINEARITY = ("load_exponent", "error_percent_peak_linear", "error_percent_peak_power", "load_trend_share")
_STATISTICS = {
    "lack_of_fit": "lack of fit (residual over pure-error mean square)",
    "error_percent_peak": "error, % of peak, mean over elements",
    "noise_percent_peak": "noise of one reading, % of peak, mean over elements",
    "ess_bulk": "bulk effective sample size, worst parameter",
    "rhat": "R-hat, worst parameter",
    "load_exponent": "exponent n of the load in readings ∝ Pⁿ (1 if linear)",
    "error_percent_peak_linear": "error with the load as it is (n = 1), % of peak",
    "error_percent_peak_power": "error with that exponent, % of peak",
    "load_trend_share": "share of the errors' variance that a trend in the load explains",
    "load_spread": "spread of unmeasured loads, share of their mean",
    "load_scatter": "error that all elements share in a touch, as a load in N",
    "place_error": "error of the place that all elements share in a touch, mm",
    "log_score": "log predictive density of readings left out",
    "map_length_mm": "correlation length of the empirical map, mm",
    "map_size_everywhere": "size of the empirical map, share of the signal's peak",
    "map_size_of_kernel": "size of the empirical map, share of the kernel",
}
# Symbol and meaning of derived quantities of a calibration.
_DERIVED = {
    "gain": ("1/G", "reading per unit of compressive strain"),
    "noise_sd": ("", "noise of one raw reading"),
    "discrepancy_sd": ("", "model error beyond noise"),
}


def about_calibration(evidence: Evidence, peak: dict[str, Any]) -> dict[str, Any]:
    """Numbers of ``report.json`` about the calibration; `peak` is the body's table of errors and noise."""
    calibration = evidence.calibration
    statistics = {name: float(value) for name, value in calibration.statistics.items()}
    return {
        "touches": len(calibration.rows.touch),
        "settings": [{"name": in_words(name), "value": value} for name, value in calibration.settings.items()],
        "statistics": statistic_rows(statistics),
        "models": model_rows(statistics, used_model(calibration.settings)),
        "linearity": {name: statistics.get(name) for name in _LINEARITY},
        "lack_of_fit": statistics.get("lack_of_fit"),
        "error_percent_peak": statistics.get("error_percent_peak"),
        "parameters": parameter_rows(evidence),
        "elements": element_table(calibration),
        "peak": peak,
    }


def in_words(name: str) -> str:
    """Description of a statistic or setting of a calibration."""
    return _STATISTICS.get(name, name.replace("_", " "))


def used_model(settings: Mapping[str, str | float]) -> str:
    """Name of the model that a pad's calibration uses, as `model_rows` has it."""
    kernel, with_map = str(settings.get("kernel", "")), settings.get("empirical_map") == "yes"
    return "map alone" if with_map and kernel == "constant" else f"{kernel} with map" if with_map else kernel


def model_rows(statistics: Mapping[str, float], used: str) -> list[dict[str, Any]]:
    """Models compared on a pad, the best first: held-out log score, error in % of the peak, whether it is used."""
    # Names of statistics have no hyphens, those of kernels may have.
    kernels = {name.replace("-", "_"): name for name in kernel_names(1)}
    rows = []
    for key in _scores(statistics):
        model = key.removeprefix(_SCORE)
        kernel = model.removesuffix("_with_map")
        name = kernels.get(kernel, kernel).replace("_", " ") + model.removeprefix(kernel).replace("_", " ")
        rows.append(
            {
                "model": name,
                "map": model == "map_alone" or model.endswith("_with_map"),
                "log_score": statistics[key],
                "error_percent_peak": statistics.get(f"{_ERROR}{model}"),
                "used": name == used,
            }
        )
    return sorted(rows, key=lambda row: -float(row["log_score"]))


def _scores(statistics: Mapping[str, float]) -> list[str]:
    return [name for name in statistics if name.startswith(_SCORE)]


def statistic_rows(statistics: Mapping[str, float]) -> list[dict[str, Any]]:
    """All other statistics of the calibration."""
    shown_elsewhere = {
        f"{start}{key.removeprefix(_SCORE)}" for key in _scores(statistics) for start in (_SCORE, _ERROR)
    }
    return [
        {"name": in_words(name), "value": value} for name, value in statistics.items() if name not in shown_elsewhere
    ]


def describe(calibration: Calibration, name: str) -> tuple[str, str, str, str]:
    """Symbol, unit, prior and meaning of a parameter or derived quantity in the calibration's posterior."""
    known: Mapping[str, Parameter] = {parameter.name: parameter for parameter in calibration.parameters}
    if name in known:
        parameter = known[name]
        return parameter.symbol, parameter.unit, str(parameter.prior), parameter.description
    symbol, meaning = _DERIVED.get(name, ("", in_words(name)))
    unit = units_of(calibration).get(name, "")
    return symbol or in_words(name), unit, "", meaning


def parameter_rows(evidence: Evidence) -> list[dict[str, Any]]:
    """Posterior and prior, one row a parameter; if it has a value for each element, smallest, mean and largest mean."""
    rows = []
    calibration = evidence.calibration
    for name, draws in calibration.posterior.items():
        symbol, unit, prior, meaning = describe(calibration, name)
        true = evidence.truth.get(name)
        if draws.ndim > 2:
            draws = calibration.of_elements_read(draws)
            true = None if true is None else calibration.of_elements_read(np.asarray(true))
        mean, sd = draws.mean(axis=(0, 1)), draws.std(axis=(0, 1))
        rows.append(
            {
                "name": name,
                "symbol": symbol,
                "unit": unit,
                "meaning": meaning,
                "prior": prior or None,
                "by_element": bool(mean.ndim),
                "mean": float(np.mean(mean)),
                "sd": float(np.sqrt(np.mean(sd**2))),
                "minimum": float(np.min(mean)) if mean.ndim else None,
                "maximum": float(np.max(mean)) if mean.ndim else None,
                "inside_90_percent": None if true is None else _inside(draws, true),
                "true_mean": None if true is None else float(np.mean(true)),
            }
        )
    return rows


def _inside(draws: FloatArray, true: Any) -> float:
    """Percentage of true values inside the central 90 % interval."""
    low, high = np.quantile(draws, [0.05, 0.95], axis=(0, 1))
    value = np.asarray(true, dtype=float)
    return float(100 * np.mean((value >= low) & (value <= high)))


def element_table(calibration: Calibration) -> dict[str, Any]:
    """Posterior mean and standard deviation of every parameter that has a value for each element."""
    m = calibration.sensor.n_elements
    own = {name: draws for name, draws in calibration.posterior.items() if draws.shape[2:] == (m,)}
    columns = []
    for name in own:
        symbol, unit, _, _ = describe(calibration, name)
        columns.append({"name": name, "symbol": symbol, "unit": unit})
    error, noise = error_and_noise(calibration)
    rows = []
    for element in range(m):
        values = [
            {"mean": float(draws[..., element].mean()), "sd": float(draws[..., element].std())}
            for draws in own.values()
        ]
        rows.append(
            {
                "element": f"e{element + 1:02d}",
                "values": values,
                "error_percent_peak": float(error[element]),
                "noise_percent_peak": float(noise[element]),
            }
        )
    return {"columns": columns, "rows": rows}
