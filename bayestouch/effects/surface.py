"""The effect of a surface that is out of round."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.recording import Recording
from bayestouch.chain.surface import Profile, profile_basis
from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values
from bayestouch.priors.parameters import Normal

# Correlation length of the curvature, degree: contacts of flats on soft rubber are 10° to 20° wide and average over
# shorter changes. Splines through knots 9° apart follow a smooth function of this length to 4 % of its sd.
LENGTH_DEG, KNOT_SPACING_DEG = 10.0, 9.0
# Standard deviation of the departure of the curvature, over 1/r_b: on a finger of 12.7 mm this is 0.1 to 0.2 mm of
# radius. Touches with blunt tips determine the curvature at their locations much better than this prior.
SPREAD = 0.15
# f has no constant part and no part with a period of one turn: these would change the radius and move the centre of the
# closed surface. Waves above the highest one have less than a thousandth of the variance.
LOWEST_WAVE, HIGHEST_WAVE = 2, 120


@dataclass(frozen=True)
class SurfaceProfile(Effect):
    """The surface is out of round: 1/R = 1/r_c + 1/r_b + f(θ_c), with a smooth function f of the place touched.

    f is a Gaussian process with a correlation length of 10°. Its mean over a turn is zero: another mean is another
    radius r_b. Its part with one wave per turn is zero, too: with such a part the curve would not be closed. f is a
    cubic spline through knots at most 9° apart over the touched range. The weights are independent; a matrix makes the
    correlated values at the knots from them. f changes the readings of a flat most, and those of a knife edge not at
    all. If the model has no f, the estimate of a composite radius R has an error near -R² f. The responses of the
    elements cannot explain this error. A response is a reading under a knife edge, and f does not change such readings.

    Reference: K. L. Johnson, Contact Mechanics (1985), section 4.2 (relative curvature); D. J. Whitehouse, Handbook of
    Surface and Nanometrology (2010), on roundness (undulations per revolution); C. E. Rasmussen and C. K. I. Williams,
    Gaussian Processes (2006), section 4.2 (Matérn).
    """

    parameters: tuple[EffectParameter, ...]
    knots_deg: tuple[float, ...]

    name: ClassVar[str] = "surface_profile"
    stage: ClassVar[Stage] = "contact"
    summary: ClassVar[str] = "surface out of round, whose curvature depends on where the touch is"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        outer = setting.radii_mm[1]
        low, high = setting.place_range[0]
        if not setting.finger or not outer > 0 or not high - low > KNOT_SPACING_DEG:
            return None
        knots = np.linspace(low, high, int(np.ceil((high - low) / KNOT_SPACING_DEG)) + 1)
        prior, probe = Normal(0.0, SPREAD / outer), (0.3 * SPREAD / outer,)
        return cls(
            tuple(
                EffectParameter(f"weight_{i:02d}", "1/mm", f"weight of the knot at {knot:.4g}°", prior, probe, 0.0)
                for i, knot in enumerate(knots, start=1)
            ),
            tuple(knots.tolist()),
        )

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        return chain.with_(surface=Profile(self.knots_deg, correlated(self.knots_deg) @ np.array(values)))

    def by_place(self, recording: Recording) -> FloatArray:
        return self.departures(recording.place[0])

    def shifted(self, recording: Recording, by: FloatArray) -> Recording:
        return replace(recording, curvature_per_mm=by)

    def departures(self, angle_deg: FloatArray) -> FloatArray:
        """Change (..., k) of the curvature per unit of each weight, at angles (...) in degree."""
        return profile_basis(self.knots_deg, np.radians(angle_deg)) @ correlated(self.knots_deg)


@lru_cache(maxsize=8)
def correlated(knots_deg: tuple[float, ...]) -> FloatArray:
    """Symmetric square root (k, k) of the correlation matrix of f (Matérn 5/2 on the circle) at knots in degree."""
    waves = np.arange(LOWEST_WAVE, HIGHEST_WAVE + 1)
    power = (1 + (waves * np.radians(LENGTH_DEG)) ** 2 / 5) ** -3.0
    apart = np.radians(np.subtract.outer(knots_deg, knots_deg))
    correlation = np.cos(apart[..., None] * waves) @ (power / power.sum())
    values, vectors = np.linalg.eigh(correlation)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)
