"""All numbers of a report in one dictionary."""

from __future__ import annotations

from typing import Any

from bayestouch.data.json_values import strict
from bayestouch.reporting.about import about_data
from bayestouch.reporting.answer import answer
from bayestouch.reporting.bodies import PAGES
from bayestouch.reporting.calibration_tables import about_calibration
from bayestouch.reporting.evidence import Evidence
from bayestouch.reporting.headline import headline
from bayestouch.reporting.made import command, versions
from bayestouch.reporting.next_steps import next_steps
from bayestouch.reporting.next_touches import about_next_touches
from bayestouch.reporting.residuals import about_residuals
from bayestouch.reporting.touch_list import about_touches
from bayestouch.reporting.trust import (
    calibration_convergence,
    calibration_uncertainty,
    convergence,
    coverage,
)
from bayestouch.reporting.verdict import short_answers
from bayestouch.version import __version__


def numbers_of_touches(evidence: Evidence) -> dict[str, Any]:
    """Content of ``report.json`` but for the checks and what a diagnosis changes, which can be made at another time."""
    pages = PAGES[evidence.sensor.body.kind]
    own = pages.numbers(evidence)
    numbers: dict[str, Any] = {
        "bayestouch": {
            "version": __version__,
            "seed": evidence.seed,
            "draws_per_touch": evidence.draws,
            "plug_in": evidence.plug_in,
        },
        "data": about_data(evidence),
        "calibration": about_calibration(evidence, own.peak),
        "estimates": own.estimates,
        "residuals": about_residuals(evidence, own.prediction),
        "trust": {
            "coverage": coverage(evidence),
            "calibration_uncertainty": calibration_uncertainty(evidence, pages.plug_in_compared),
            "convergence": convergence(evidence.posteriors),
            "calibration_convergence": calibration_convergence(evidence.calibration),
        },
        "checks": None,
        "paper": own.paper,
        "places": own.places,
        "diagnosis": None,
        "touches": about_touches(evidence),
        "next_touches": about_next_touches(evidence.calibration),
    }
    return dict(strict(numbers))


def with_checks(numbers: dict[str, Any], checks: dict[str, Any]) -> dict[str, Any]:
    """The numbers with those of `bayestouch.reporting.checks.about_checks`."""
    return {**numbers, "checks": strict(checks)}


def with_diagnosis(numbers: dict[str, Any], evidence: Evidence) -> dict[str, Any]:
    """Content of ``report.json``: that without a diagnosis, and the diagnosis of the evidence if it has one."""
    made = {"versions": versions(evidence), "command": command(evidence)}
    diagnosis = None if evidence.diagnosed is None else strict(evidence.diagnosed.numbers)
    numbers = {**numbers, "bayestouch": {**numbers["bayestouch"], **made}, "diagnosis": diagnosis}
    numbers["next"] = next_steps(evidence, numbers)
    said = {**answer(numbers), "verdict": short_answers(numbers)}
    said["headline"] = headline(PAGES[evidence.sensor.body.kind].headline(evidence), evidence)
    return {"answer": strict(said), **numbers}
