"""Simulated fingers with rows without contact, whose errors are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import bayestouch
from bayestouch.data.touches import Touches
from bayestouch.model.split_data import joined_tables

NOISE, SAMPLES, ROWS = 20.0, 8, 4
DESIGN = bayestouch.FingerDesign(
    n_elements=5, edge_step_deg=3.0, flat_step_deg=6.0, touch_step_deg=5.0, samples_per_touch=SAMPLES
)
DESIGN = replace(DESIGN, noise_percent_peak=100 * NOISE / DESIGN.peak_reading)


def with_rest(table: Touches, rest: np.ndarray, offset: float = 300.0) -> Touches:
    """The table with an offset, after rows (k, m) without contact."""
    k = len(rest)
    one = table.select(np.zeros(k, dtype=np.int64))
    away = one.with_(readings=offset + rest, load=np.zeros(k), contact=np.zeros(k), sample=np.arange(k))
    return joined_tables(away.with_(touch=np.full(k, 10**6)), table.with_(readings=offset + table.readings))


def dataset(seed: int, effect: float = 0.0) -> tuple[bayestouch.DataSet, np.ndarray]:
    """A finger with rest rows at the start of both tables, and the errors (2, m) of their means."""
    effects = {"crosstalk": effect} if effect else {}
    made = bayestouch.simulate(DESIGN, effects=effects, seed=seed).dataset
    rng = np.random.default_rng(seed)
    rows = NOISE * rng.standard_normal((2, ROWS, 5))
    assert made.calibration is not None
    tables = (with_rest(table, each) for table, each in zip((made.calibration, made.touches), rows, strict=True))
    calibration, touches = tables
    return replace(made, calibration=calibration, touches=touches), rows.mean(axis=1)


def with_own_rest(table: Touches, rng: np.random.Generator, offset: float = 300.0) -> Touches:
    """The table with an offset, and one row without contact in each touch."""
    _, first = np.unique(table.touch, return_index=True)
    one, t = table.select(np.sort(first)), len(first)
    rest = offset + NOISE * rng.standard_normal((t, table.n_elements))
    away = one.with_(readings=rest, load=np.zeros(t), contact=np.zeros(t), sample=np.full(t, 99))
    both = joined_tables(away, table.with_(readings=offset + table.readings))
    return both.with_(touch=np.concatenate([away.touch, table.touch]))
