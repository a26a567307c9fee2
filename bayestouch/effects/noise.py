"""Effects of the noise: errors of readings that are not independent, identically distributed and normal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.recording import Recording
from bayestouch.effects.effect import Effect, EffectParameter, Setting, Stage, Values
from bayestouch.errors import InputError
from bayestouch.priors.parameters import LogNormal, Normal, Uniform

# Log odds above which 1 + odds equals odds in double precision.
CERTAIN = 40.0


@dataclass(frozen=True, eq=False)
class Scatter:
    """Residuals of samples, from which noise effects are estimated; n samples, m elements.

    Attributes
    ----------
    z : (n, m) array
        Reading minus prediction over the sd of one reading; NaN missing.
    signal : (n, m) array
        Predicted reading over the peak.
    sd : (m,) array
        Sd of one reading over the peak.
    peak : (m,) array
        Peak reading of each element, over the mean peak reading.
    """

    z: FloatArray
    signal: FloatArray
    sd: FloatArray
    peak: FloatArray

    @cached_property
    def present(self) -> NDArray[np.bool_]:
        """Whether each reading is present (not missing), (n, m)."""
        return ~np.isnan(self.z)

    @cached_property
    def clean(self) -> FloatArray:
        """`z` with zeros where it is missing, (n, m)."""
        return np.where(self.present, self.z, 0.0)

    @cached_property
    def squares(self) -> FloatArray:
        """Squares of `clean`, (n, m)."""
        return self.clean**2

    @cached_property
    def log_signal(self) -> FloatArray:
        """Logarithm of the absolute value of `signal`, (n, m)."""
        return np.asarray(np.log(np.maximum(np.abs(self.signal), 1e-300)))

    @cached_property
    def covariance(self) -> FloatArray:
        """Covariance of `z` about zero, (m, m)."""
        clean, count = self.clean, self.present.astype(float)
        return np.asarray(clean.T @ clean / np.maximum(count.T @ count, 1))


class NoiseEffect(Effect):
    """An effect that changes the distribution of the errors of one sample, not its prediction.

    `Scatter.sd` is the sd of all noise, with that of the effect. The own noise of an element is the remaining part.
    """

    def log_density(self, scatter: Scatter, values: Values) -> FloatArray:
        """Log density of each sample (n,), up to a constant; the own noise is that of `own`."""
        return np.asarray(self.terms(scatter, values, self.own(scatter, values)).sum(axis=1))

    def terms(self, scatter: Scatter, values: Values, own: FloatArray) -> FloatArray:
        """Terms that add up over axis 1 to the log density of each sample; `own` (m,) is as returned by `own`.

        Shape (n, m), one term for each element, if elements are independent; else (n, 1).
        """
        raise NotImplementedError

    def errors(self, recording: Recording, values: Values, rng: np.random.Generator) -> FloatArray:
        """Errors (n, m) that a simulation adds to the signal, drawn from the density of `log_density`.

        Raises
        ------
        InputError
            The effect does not override this method: it cannot be simulated.
        """
        raise InputError(f"effect {self.name} cannot be simulated: it has no method `errors`")

    def simulate(self, recording: Recording, values: Values, rng: np.random.Generator) -> FloatArray:
        return np.asarray(recording.signal + self.errors(recording, values, rng))

    def own(self, scatter: Scatter, values: Values) -> FloatArray:
        """Variance of each element's own noise over that of all its noise, (m,), from the moments of the samples."""
        return np.ones(len(scatter.sd))

    def added(self, values: Values) -> Mapping[str, float]:
        """Fields of `bayestouch.model.noise.AddedNoise` that the effect sets, with their values.

        If the mapping is empty, the effect is reported, but the uncertainty of predictions does not change.
        """
        return {}

    def wrong(
        self, deviation: FloatArray, sd: FloatArray, peak: FloatArray, values: Values
    ) -> NDArray[np.bool_] | None:
        """Whether each reading is probably wrong (above 50 %), (n, m); None for an effect without wrong readings.

        Parameters
        ----------
        deviation : (n, m) array
            Reading minus median of its touch; NaN where the touch has too few readings.
        sd : (m,) or (n, m) array
            Standard deviation of a reading that is not wrong, of each element or of each reading.
        peak : (m,) array
            Peak reading, in the unit of `deviation`.
        values : tuple of float
            Values of the effect.
        """
        return None


@dataclass(frozen=True)
class CommonModeNoise(NoiseEffect):
    """All elements have the same random error in each sample, e.g. hum on the supply or noise of the reference.

    With `shared` = 0 its sd is a share of each element's own peak (the error comes before the gains), with `shared` = 1
    a share of the mean peak, equal in all elements (it comes after the gains).

    Reference: H. W. Ott, Electromagnetic Compatibility Engineering (2009), on common-impedance coupling.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter(
            "sd", "", "sd of the shared error, over the peak reading", Normal(0.0, 0.05, 0.0), (0.005,), 0.0
        ),
        EffectParameter("shared", "", "0: of each element's own peak, 1: of the mean peak", Uniform(0, 1), (0.0, 1.0)),
    )

    name: ClassVar[str] = "common_mode_noise"
    stage: ClassVar[Stage] = "noise"
    summary: ClassVar[str] = "an error that all elements share in a sample"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls() if setting.n_elements > 2 else None

    def terms(self, scatter: Scatter, values: Values, own: FloatArray) -> FloatArray:
        size = values[0] * scatter.peak ** -values[1] / scatter.sd
        present = scatter.present.astype(float)
        length2 = present @ (size**2 / own)
        squares = scatter.squares @ (1 / own) - (scatter.clean @ (size / own)) ** 2 / (1 + length2)
        volume = np.log1p(length2) + present @ np.log(own)
        return np.asarray(-0.5 * (squares + volume))[:, None]

    def errors(self, recording: Recording, values: Values, rng: np.random.Generator) -> FloatArray:
        sd, shared = values
        size = sd * recording.peak ** (1 - shared) * float(recording.peak.mean()) ** shared
        return np.asarray(size * rng.standard_normal((recording.n_rows, 1)))

    def added(self, values: Values) -> Mapping[str, float]:
        return {"common": values[0], "common_shared": values[1]}

    def own(self, scatter: Scatter, values: Values) -> FloatArray:
        """See `NoiseEffect.own`.

        The own variance is the total variance minus that of the shared error, but at least the scatter of each element
        about the mean of all elements: the difference is not accurate where the shared error dominates. An element
        without readings has no part in that mean.
        """
        direction, covariance = scatter.peak ** -values[1] / scatter.sd, scatter.covariance
        direction = np.where(scatter.present.any(axis=0), direction, 0.0)
        share = direction / (direction**2).sum()
        # Let f be the mean of the elements weighted by `share`: the variances of z - direction f are linear in the
        # own variances.
        together = covariance @ share
        about = np.diag(covariance) - 2 * direction * together + direction**2 * float(share @ together)
        matrix = np.diag(1 - 2 * direction * share) + np.outer(direction**2, share**2)
        least = np.linalg.lstsq(matrix, about, rcond=None)[0]
        return np.asarray(np.maximum(1 - (values[0] * direction) ** 2, np.clip(least, 0.005, 1.0)))


@dataclass(frozen=True)
class SignalDependentNoise(NoiseEffect):
    """The noise increases with the signal: sd² = sd_0² + (share |y/peak|^power)², sd in units of the peak.

    sd is the standard deviation of the noise of a reading y, and sd_0 that of a reading without signal.
    Noise of the gain is proportional to the signal (power 1), shot noise of light or charge to its root (power 0.5).

    Reference: J. R. Janesick, Photon Transfer (2007), on noise against signal.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter(
            "share", "", "sd of the added noise at the peak, over the peak", Normal(0.0, 0.05, 0.0), (0.005,), 0.0
        ),
        EffectParameter("power", "", "power of the signal", LogNormal(0.8, 0.4), (1.0, 0.5)),
    )

    name: ClassVar[str] = "signal_dependent_noise"
    stage: ClassVar[Stage] = "noise"
    summary: ClassVar[str] = "noise that increases with the signal"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls()

    def terms(self, scatter: Scatter, values: Values, own: FloatArray) -> FloatArray:
        variance = own + self._share(scatter, values)
        return np.asarray(-0.5 * (scatter.squares / variance + np.log(variance)) * scatter.present)

    def own(self, scatter: Scatter, values: Values) -> FloatArray:
        """See `NoiseEffect.own`: one minus the mean over samples of the variance that depends on the signal."""
        present = scatter.present
        mean = (self._share(scatter, values) * present).sum(axis=0) / np.maximum(present.sum(axis=0), 1)
        return np.asarray(np.maximum(1 - mean, 0.02))

    def added(self, values: Values) -> Mapping[str, float]:
        return {"share": values[0], "power": values[1]}

    def _share(self, scatter: Scatter, values: Values) -> FloatArray:
        """Variance that depends on the signal, over the variance of all noise, (n, m)."""
        share, power = values
        return np.asarray(np.exp(2 * power * scatter.log_signal) * (share / scatter.sd) ** 2)

    def errors(self, recording: Recording, values: Values, rng: np.random.Generator) -> FloatArray:
        share, power = values
        sd = share * recording.peak * np.abs(recording.signal / recording.peak) ** power
        return np.asarray(sd * rng.standard_normal(recording.signal.shape))


@dataclass(frozen=True)
class Outliers(NoiseEffect):
    """A few readings have errors much larger than the noise, e.g. from lost bits or loose contacts.

    A share `probability` of the readings has an additional normal error with the sd `size`.

    Reference: D. W. Hogg, J. Bovy and D. Lang, Data analysis recipes: Fitting a model to data (2010), section 3.
    """

    parameters: tuple[EffectParameter, ...] = (
        EffectParameter("probability", "", "share of the readings", Uniform(0.0, 0.3), (0.003, 0.03), 0.0),
        EffectParameter("size", "", "sd of their errors over the peak reading", LogNormal(0.3, 0.8), (0.1, 0.5)),
    )

    name: ClassVar[str] = "outliers"
    stage: ClassVar[Stage] = "noise"
    summary: ClassVar[str] = "occasional wrong readings"
    mixes: ClassVar[bool] = False

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls()

    def own(self, scatter: Scatter, values: Values) -> FloatArray:
        """See `NoiseEffect.own`: one minus the mean of the added variance."""
        probability, size = values
        return np.asarray(np.maximum(1 - probability * (size / scatter.sd) ** 2, 0.005))

    def terms(self, scatter: Scatter, values: Values, own: FloatArray) -> FloatArray:
        probability, size = values
        wide = own + (size / scatter.sd) ** 2
        usual = np.log1p(-probability) - 0.5 * np.log(own) - 0.5 * scatter.squares / own
        # Log odds of a wrong reading; above CERTAIN, log(1 + odds) equals log(odds).
        odds = np.log(max(probability, 1e-300)) - np.log1p(-probability) + 0.5 * np.log(own / wide)
        odds = odds + 0.5 * scatter.squares * (1 / own - 1 / wide)
        either = usual + np.where(odds > CERTAIN, odds, np.log(1 + np.exp(np.minimum(odds, CERTAIN))))
        return np.asarray(either * scatter.present)

    def wrong(self, deviation: FloatArray, sd: FloatArray, peak: FloatArray, values: Values) -> NDArray[np.bool_]:
        probability, size = values
        wide = sd**2 + (size * peak) ** 2
        with np.errstate(invalid="ignore"):
            usual = np.log1p(-probability) - 0.5 * (deviation**2 / sd**2 + np.log(sd**2))
            wrong = np.log(max(probability, 1e-300)) - 0.5 * (deviation**2 / wide + np.log(wide))
            return np.asarray(~np.isnan(deviation) & (wrong > usual))

    def errors(self, recording: Recording, values: Values, rng: np.random.Generator) -> FloatArray:
        probability, size = values
        wrong = rng.random(recording.signal.shape) < probability
        return np.asarray(wrong * size * recording.peak * rng.standard_normal(recording.signal.shape))
