"""Infer: the touches are unknown, the sensor is known up to its posterior."""

from __future__ import annotations

from bayestouch.errors import InputError, shown
from bayestouch.indenter_priors import IndenterPrior
from bayestouch.progress import Progress
from bayestouch.results import Calibration, TouchPosteriors
from bayestouch.sensor import Finger
from bayestouch.touches import Touches

__all__ = ["infer"]


def infer(
    touches: Touches,
    calibration: Calibration,
    *,
    indenter: IndenterPrior | None = None,
    plug_in: bool = False,
    use_load: bool = True,
    check_sensor: bool = True,
    each_sample: bool = False,
    method: str = "emcee",
    draws: int = 1024,
    seed: int = 0,
    workers: int | None = None,
    progress: Progress | None = None,
) -> TouchPosteriors:
    """Posterior of every touch: on a finger r_c, R, θ_c and P; on a pad x, y and P.

    Parameters
    ----------
    touches : Touches
        What was read. Reference locations and radii are carried along, never used.
    calibration : Calibration
        The calibrated sensor.
    indenter : IndenterPrior, optional
        What is known of the indenters beforehand (fingers only): `UniformRadius` (the default), `UniformCurvature`,
        `IndenterDistribution`, `KnownTips` or `EdgeOrRound`. With the last two the result's `tips` says how
        probable each is for each touch, and the draws of R and r_c take the tips' values.
    plug_in : bool
        Take the calibration at its mode instead of integrating over what it leaves uncertain.
    use_load : bool
        Use the force sensor's reading where there is one.
    check_sensor : bool
        Look for elements (dead, stuck, swapped, of another gain or zero) and a force sensor that no longer read as
        calibrated, and go on without them; the notes say which (fingers only).
    each_sample : bool
        A posterior for each sample in place of one for each touch's mean (fingers only).
    method : {"emcee", "importance"}
        Markov chains by emcee, or Pareto-smoothed importance sampling that falls back to them where a touch's
        weights are poor (fingers only).
    draws : int
        Draws a touch, over all chains.
    seed : int
        Seed of every random number; a touch's draws depend on it and on the touch's place in the table alone.
    workers : int, optional
        Processes; as many as there are cores by default. The result does not depend on it.
    progress : callable, optional
        Called with the fraction done.

    Raises
    ------
    InputError
        If the table does not fit the calibrated sensor or no row is in contact.
    """
    if method not in ("emcee", "importance"):
        raise InputError(f"method: expected emcee or importance, got {method!r}")
    if draws < 64:
        raise InputError(f"draws: expected at least 64, got {draws}")
    if indenter is not None and not isinstance(indenter, IndenterPrior):
        raise InputError(f"indenter: expected a prior over indenters such as KnownTips((0, 2)), got {shown(indenter)}")
    m = calibration.sensor.n_elements
    if touches.n_elements != m:
        raise InputError(f"the table has {touches.n_elements} elements, the calibrated sensor {m}")
    if not touches.in_contact.any():
        raise InputError("no row of the table is in contact: there is nothing to infer")
    if isinstance(calibration.sensor.body, Finger):
        from bayestouch.inference.finger import infer_finger

        return infer_finger(
            touches,
            calibration,
            plug_in=plug_in,
            use_load=use_load,
            check_sensor=check_sensor,
            each_sample=each_sample,
            method=method,
            draws=draws,
            seed=seed,
            workers=workers,
            progress=progress,
            indenter=indenter,
        )
    if each_sample or method != "emcee":
        raise InputError("each_sample and method are options of fingers; a pad is read touch by touch with emcee")
    if indenter is not None:
        raise InputError("indenter is an option of fingers; a pad does not tell radii")
    from bayestouch.inference.pad import infer_pad

    return infer_pad(
        touches, calibration, plug_in=plug_in, use_load=use_load, draws=draws, seed=seed, progress=progress
    )
