"""Whether the draws of a calibration reach the targets of the sampler, in words."""

from __future__ import annotations

from collections.abc import Mapping

from bayestouch.output.text import number
from bayestouch.sampling.draws import Demands


def targets_missed(statistics: Mapping[str, float]) -> tuple[str, ...]:
    """Sentence on draws that miss the targets of the sampler; empty if they meet them, or have no such statistics.

    Parameters
    ----------
    statistics : mapping of str to float
        ``ess_bulk`` and ``rhat`` of the worst parameter, among others.
    """
    size, rhat = statistics.get("ess_bulk"), statistics.get("rhat")
    if size is None or rhat is None or Demands().met(size, rhat):
        return ()
    return (
        "The sampler did not reach its targets for the calibration (effective sample size "
        f"{number(size, 2)}, R-hat {number(rhat)}), so its posterior is rough.",
    )
