"""Estimates, draws and residuals of single touches, for the interactive figures."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayestouch.checking.tables import indenter_name
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.places import rounded
from bayestouch.reporting.residuals import standardised
from bayestouch.results.plots import reference_near, shown_pair

# More touches, or more draws of each, would make the page slow and large; posterior.nc has all of them.
MOST_TOUCHES, DRAWS = 480, 80


def about_touches(evidence: Evidence) -> dict[str, Any]:
    """Columns with one entry a touch; of many touches, a selection evenly spread over the table.

    Returns
    -------
    dict
        ``touch``, ``indenter``, ``parameters`` (by name: unit, reference, mean, sd, low, high of the central 90 %),
        ``draws`` (of the two parameters that are plotted against each other), ``residuals`` (by touch and element,
        divided by their standard deviation), ``of`` (total number of touches).
    """
    posteriors = evidence.posteriors
    count, shown = len(posteriors.rows.touch), shown_pair(posteriors.posterior)
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_TOUCHES)).round().astype(int))
    parameters = {}
    for parameter in posteriors.parameters:
        name = parameter.name
        mean, sd, (low, high) = posteriors.mean(name), posteriors.sd(name), posteriors.interval(name)
        columns = {
            "reference": reference_near(posteriors, name, mean),
            "mean": mean,
            "sd": sd,
            "low": low,
            "high": high,
        }
        parameters[name] = {
            "symbol": parameter.symbol,
            "unit": parameter.unit,
            **{key: rounded(np.asarray(values)[chosen], step=sd[chosen]) for key, values in columns.items()},
        }
    return {
        "of": count,
        "touch": [int(each) for each in posteriors.rows.touch[chosen]],
        "indenter": [indenter_name(float(each)) for each in posteriors.rows.radius_mm[chosen]],
        "parameters": parameters,
        "shown": list(shown),
        "draws": {name: _rounded_draws(posteriors.posterior[name], chosen) for name in shown},
        "residuals": rounded(standardised(posteriors.rows)[chosen], 3),
    }


def _rounded_draws(draws: Any, chosen: Any) -> Any:
    """Selected draws (touches, draws), evenly spread over chains and draws."""
    flat = np.asarray(draws[..., chosen]).reshape(-1, len(chosen))
    some = flat[np.linspace(0, len(flat) - 1, min(len(flat), DRAWS)).astype(int)].T
    return rounded(some, step=flat.std(axis=0)[:, None])
