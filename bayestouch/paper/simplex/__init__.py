"""Fitting methods of the paper, mostly the simplex method of Nelder and Mead: point estimates for comparison."""

from __future__ import annotations

from bayestouch.paper.simplex.elements import ElementFit, fit_element
from bayestouch.paper.simplex.empirical import EmpiricalTable, table_2
from bayestouch.paper.simplex.empirical_finger import EmpiricalFinger
from bayestouch.paper.simplex.tables import ElementTable, table_1
from bayestouch.paper.simplex.touches import TouchFit, TouchPredictor, fit_touch, fit_touches

__all__ = [
    "ElementFit",
    "ElementTable",
    "EmpiricalFinger",
    "EmpiricalTable",
    "TouchFit",
    "TouchPredictor",
    "fit_element",
    "fit_touch",
    "fit_touches",
    "table_1",
    "table_2",
]
