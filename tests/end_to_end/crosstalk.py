"""A finger with crosstalk, written out: each element hears its neighbours, and theirs by so much less."""

from __future__ import annotations

import numpy as np
import written_out as w

SHARE, REACH, LEAN = 0.06, 0.2, 0.0


def heard(values: np.ndarray) -> np.ndarray:
    """What each element (row) hears of each other (column), of share, reach and lean."""
    share, reach, lean = values
    steps = np.arange(w.ELEMENTS)[:, None] - np.arange(w.ELEMENTS)
    away = np.maximum(np.abs(steps) - 1, 0)
    return share * np.where(steps == 0, 0.0, reach**away * (1 + lean * np.sign(steps)))


def leaked(readings: np.ndarray, values: tuple[float, ...] | np.ndarray = (SHARE, REACH, LEAN)) -> np.ndarray:
    """Readings (..., m) after crosstalk."""
    return readings + readings @ heard(np.asarray(values)).T


def predict(parameters: np.ndarray, pressed: w.Pressed) -> np.ndarray:
    """Readings of a finger with `written_out.parameters_of` and then share, reach and lean."""
    clean = w.finger_at(parameters[:-3]).predict(pressed.radius, pressed.angle, pressed.load)
    return leaked(clean, parameters[-3:])


def slopes(parameters: np.ndarray, pressed: w.Pressed) -> np.ndarray:
    """Derivative (d, t, m) of `predict`."""
    of_finger = leaked(w.slopes(parameters[:-3], pressed), parameters[-3:])
    out = [*of_finger]
    for place in range(len(parameters) - 3, len(parameters)):
        ends = []
        for sign in (1, -1):
            moved = parameters.copy()
            moved[place] += sign * 1e-3
            ends.append(predict(moved, pressed))
        out.append((ends[0] - ends[1]) / 2e-3)
    return np.array(out)


def prior_sd(parameters: np.ndarray) -> np.ndarray:
    """Standard deviations of all priors; the uniform one of reach, 0 to 1, by its middle 68 %."""
    return np.concatenate([w.prior_sd(parameters[:-3]), [0.1, 0.5 * (0.841 - 0.159), 0.2]])
