"""Gains of a pad that may be zero: changes of variables for elements that no touch, or only a tail of it, reached."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import FloatArray, IntArray
from bayestouch.pad.density import PadDensity
from bayestouch.pad.priors import prior_precision

# A gain is loose if it is fewer standard deviations than this from zero. Of others, the other sign has a probability of
# less than a thousandth.
LOOSE = 3.0
# Number of touches in the kernel below: the nearest ones, of which an element reads most. A proposal need not be exact.
NEAREST = 50


@dataclass(frozen=True, eq=False)
class LooseGains:
    """Normal distributions of loose gains given the places of their elements; q elements, D coordinates.

    Readings show the product of the gain and the kernel at the touches. So the gain may be large if the element is far
    from the touches, and must be small if it is near, with either sign. Given the place x the gain is normal. With the
    root mean square k of load times kernel over the touches, and r = k(x)/k(x₀), it has the precision ``A r² + p`` and
    a mean in proportion to ``r / (A r² + p)``, where A is what the readings show at x₀, and p is that of the prior.

    Attributes
    ----------
    elements : (q,) int array
        Elements with a loose gain.
    entries : (q, D) int array
        Entries of the vector with their places.
    place : (q, D) array
        Middles x₀ of the priors of their places, mm.
    shown, prior : (q,) arrays
        The precisions A and p.
    density : PadDensity
        Touches, and the kernel at its mode.
    """

    elements: IntArray
    entries: IntArray
    place: FloatArray
    shown: FloatArray
    prior: FloatArray
    density: PadDensity

    @classmethod
    def of(cls, density: PadDensity, gain_sd: FloatArray) -> LooseGains:
        """Of a posterior in which the gains have the standard deviations (m,) by the normal approximation."""
        mode, (low, high), priors = density.mode, density.bounds, density.priors
        m, dimensions = density.model.pad.position.shape
        may_be_zero = (low[:m] < 0) & (high[:m] > 0) & ~density.logarithmic[:m]
        elements = np.flatnonzero(may_be_zero & (np.abs(mode[:m]) < LOOSE * gain_sd))
        entries = elements[:, None] + m * (2 + np.arange(dimensions))
        place = np.array([[float(priors[i].quantile(0.5)) for i in each] for each in entries]).reshape(entries.shape)
        prior = np.array([prior_precision(priors[e], 0.0) for e in elements])
        loose = cls(elements, entries, place, np.zeros(len(elements)), prior, density)
        if not len(elements):
            return loose
        # The precision at the mode, moved to x₀.
        about = density.linearised(loose.centred(mode)[: density.n_model]).covariance()
        shown = np.maximum(1 / np.diag(about)[elements] - prior, 0.0)
        return cls(elements, entries, place, shown, prior, density)

    def centred(self, vector: FloatArray) -> FloatArray:
        """A vector (d,) with zero in place of the loose gains, and the middles of their places."""
        out = vector.copy()
        out[self.elements], out[self.entries] = 0.0, self.place
        return out

    def given_places(self, vectors: FloatArray, mean: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Vectors (n, d) with the gains for their places, from gains for the middle places; and log derivatives (n,).

        The gains are about `mean` (n, q) in the middle places.
        """
        out, log_derivative = vectors.copy(), np.zeros(len(vectors))
        for i, e in enumerate(self.elements):
            share = self._kernel(i, vectors[:, self.entries[i]]) / self._kernel(i, self.place[i][None])
            here, middle = self.shown[i] * share**2 + self.prior[i], self.shown[i] + self.prior[i]
            narrower = np.sqrt(middle / here)
            out[:, e] = mean[:, i] * share * middle / here + (vectors[:, e] - mean[:, i]) * narrower
            log_derivative += np.log(narrower)
        return out, log_derivative

    def _kernel(self, i: int, place: FloatArray) -> FloatArray:
        """Root mean square over the touches of load times kernel, with element number `i` at places (n, D), (n,)."""
        model = self.density.model
        pad = model.pad.with_flat(self.density.values(self.density.mode)[: len(model.pad.flat)])
        location = model.known.means.location
        near = np.argsort(((location - self.place[i]) ** 2).sum(axis=1), kind="stable")[:NEAREST]
        distance = np.sqrt(((place[:, None] - location[near]) ** 2).sum(axis=2))
        size = np.sqrt(((model.load[near] * pad.kernel(distance, pad.values)) ** 2).mean(axis=1))
        # So far from the touches that rounding leaves nothing, the gain has its prior.
        return np.asarray(np.maximum(size, 1e-150))
