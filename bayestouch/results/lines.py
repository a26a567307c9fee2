"""Lines of text that ``repr`` shows for calibrations and posteriors of touches."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.errors import few
from bayestouch.output.summary import notes_line, span
from bayestouch.output.text import fixed, number, plural, plus_minus
from bayestouch.priors.parameters import Parameter
from bayestouch.results.data import CalibrationData, PosteriorsData
from bayestouch.results.draws_on_file import DrawsOnFile
from bayestouch.results.keys import effect_names
from bayestouch.results.targets import kept_draws, targets_met


def calibration_lines(calibration: CalibrationData) -> list[str]:
    """Lines about a calibration: touches, quality of the fit, effects, parameters, grade."""
    numbers = calibration.statistics
    fit = f"error {number(numbers.get('error_percent_peak'))} % of the peak"
    fit += f" (noise {number(numbers.get('noise_percent_peak'))} %)"
    fit += f", lack of fit {number(numbers.get('lack_of_fit'))}"
    names = _effects(calibration)
    return [
        f"Calibration of {calibration.sensor.in_short}",
        f"{plural(len(calibration.rows.touch), 'touch')}, {_draws(calibration.posterior)}",
        fit,
        *([f"effects: {few(names, 8)}"] if names else []),
        "; ".join(filter(None, (_parameter(calibration, each) for each in calibration.parameters))),
        *_sampler(calibration),
        *notes_line(calibration.notes),
    ]


def _parameter(calibration: CalibrationData, parameter: Parameter) -> str:
    """Text of mean ± sd of a parameter; for one value an element, range of the means ± median sd."""
    if parameter.name not in calibration.posterior:
        return ""
    draws = np.asarray(calibration.posterior[parameter.name])
    each = draws.reshape(-1, *draws.shape[2:])
    mean, sds = (calibration.of_elements_read(values) for values in (each.mean(axis=0), each.std(axis=0)))
    sd, unit = float(np.median(sds)), f" {parameter.unit}".rstrip()
    if mean.ndim == 0:
        return f"{parameter.symbol} {plus_minus(float(mean), sd)}{unit}"
    return f"{parameter.symbol}{span(mean)}{unit} (± {number(sd, 2)})"


def _draws(posterior: Mapping[str, FloatArray]) -> str:
    kept = kept_draws(posterior)
    return "summaries only" if kept is None else f"{plural(kept[0], 'chain')} of {plural(kept[1], 'draw')}"


def _effects(calibration: CalibrationData) -> list[str]:
    return effect_names(calibration.settings)


def _sampler(calibration: CalibrationData) -> list[str]:
    numbers, settings = calibration.statistics, calibration.settings
    if "ess_bulk" in numbers:
        size, rhat = numbers["ess_bulk"], numbers["rhat"]
        grade = "met" if targets_met(numbers, kept_draws(calibration.posterior)) else "missed"
        return [f"sampler's targets {grade}: smallest effective sample size {size:.0f}, largest R-hat {fixed(rhat, 3)}"]
    return [f"posterior: {settings[key]}" for key in ("sampler", "posterior") if key in settings]


def touches_lines(posteriors: PosteriorsData) -> list[str]:
    """Lines about posteriors of touches: touches, draws, grade, short summary of the estimates."""
    count = len(posteriors.rows.touch)
    return [
        f"TouchPosteriors of {posteriors.sensor.in_short}",
        f"{plural(count, 'touch')}, {_draws(posteriors.posterior)}" if count else "there are no touches",
        *(_grades(posteriors, count) if count else []),
        *filter(None, (_estimates(posteriors, each) for each in posteriors.parameters)),
        *notes_line(posteriors.notes),
    ]


def _grades(posteriors: PosteriorsData, count: int) -> list[str]:
    """Why touches have grade 0, and how many; one line a reason."""
    reasons = [
        f"{n} of {count} {reason}"
        for n, reason in (
            (posteriors.unread, "have no reading"),
            (posteriors.beyond, "are beyond the loads or places of the calibration"),
            (posteriors.missed, "missed the sampler's targets"),
        )
        if n
    ]
    return reasons or ["all meet the sampler's targets"]


def _estimates(posteriors: PosteriorsData, parameter: Parameter) -> str:
    name, unit = parameter.name, f" {parameter.unit}".rstrip()
    # draws on file may be larger than memory, so this summary does not read them
    in_memory = not isinstance(posteriors.posterior, DrawsOnFile) and name in posteriors.posterior
    if name not in posteriors.estimates and not in_memory:
        return ""
    mean = posteriors.mean(name)
    if not mean.size or not np.isfinite(mean).all():  # r_c of a flat tip is infinite; the lines show its R
        return ""
    if mean.size == 1:
        return f"{parameter.symbol} {plus_minus(float(mean[0]), float(posteriors.sd(name)[0]))}{unit}"
    middle, sd = (number(float(np.median(each)), 3) for each in (mean, posteriors.sd(name)))
    return f"{parameter.symbol}: median {middle},{span(mean)}{unit}; median sd {sd}{unit}"
