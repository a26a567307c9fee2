"""Calibrations with the paper's methods: element by element (section 3.1) and direct identification (section 3.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from bayestouch.errors import InputError
from bayestouch.finger.calibration import finger_chain
from bayestouch.paper.simplex import ElementTable, EmpiricalFinger, EmpiricalTable, TouchPredictor, table_1, table_2
from bayestouch.reporting.differences import three
from bayestouch.reporting.evidence import Evidence

_QUANTITIES = ("poisson_ratio", "sensing_radius_mm", "error_percent_peak", "noise_percent_peak")


@dataclass(frozen=True, eq=False)
class PaperFits:
    """Results of the two calibrations of the paper; None if the data are not sufficient.

    Attributes
    ----------
    elements : ElementTable or None
        Table 1: σ, r_s, θ_s and gain of each element separately, from knife edges within 25° of it.
    empirical : EmpiricalTable or None
        Table 2: the E map, by least squares from all knife edges.
    notes : tuple of str
        Reasons why a result is missing.
    """

    elements: ElementTable | None
    empirical: EmpiricalTable | None
    notes: tuple[str, ...]

    @classmethod
    def of(cls, evidence: Evidence) -> PaperFits:
        """Results of fits to the knife edges among the calibration touches of a finger."""
        table = evidence.dataset.calibration
        assert table is not None
        # An element with one reading in all contacts is dead, whatever it reads at rest: the calibration leaves it out.
        alive = table.select(table.in_contact).usable_elements
        means = table.with_(readings=np.where(alive, table.readings, np.nan)).baseline_corrected().averaged()
        notes: list[str] = []
        elements: ElementTable | None = None
        empirical: EmpiricalTable | None = None
        try:
            elements = table_1(means, evidence.sensor, float(evidence.calibration.mode["mu"]))
            notes += elements.left_out
        except InputError as reason:
            notes.append(f"Element by element: {reason}.")
        try:
            empirical = table_2(means, evidence.sensor)
        except InputError as reason:
            notes.append(f"Direct identification: {reason}.")
        return cls(elements, empirical, tuple(notes))

    def element_summary(self) -> dict[str, dict[str, Any]]:
        """Minimum, mean and maximum over the elements, for each row of Table 1."""
        if self.elements is None:
            return {name: three([]) for name in _QUANTITIES}
        fits = self.elements.fits
        return {name: three([getattr(fit, name) for fit in fits]) for name in _QUANTITIES}

    def empirical_summary(self) -> dict[str, Any]:
        """Row of Table 2, with the error on touches left out of the fit; values are empty if there is no result."""
        found = self.empirical
        if found is None:
            names = ("error_percent_peak", "held_out_percent_peak", "noise_percent_peak")
            return {**{name: three([]) for name in names}, "coefficients": None, "rank": None, "condition_number": None}
        return {
            "error_percent_peak": three(found.error_percent_peak),
            "held_out_percent_peak": three(found.held_out_percent_peak),
            "noise_percent_peak": three(found.noise_percent_peak),
            "coefficients": int(found.map.shape[1]),
            "rank": int(found.rank),
            "condition_number": float(found.condition_number),
        }

    def empirical_finger(self, evidence: Evidence, contact: str) -> TouchPredictor | None:
        """Finger with the identified map and a contact model; None if an element has no map."""
        found = self.empirical
        if found is None or not np.isfinite(found.response).all():
            return None
        chain = finger_chain(evidence.calibration)
        return EmpiricalFinger.of(
            found,
            evidence.sensor,
            shear_modulus_MPa=chain.shear_modulus_MPa,
            poisson_ratio=chain.poisson_ratio,
            largest_load=chain.largest_load,
            contact=contact,
        )
