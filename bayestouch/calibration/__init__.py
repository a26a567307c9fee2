"""Calibration of a sensor from known touches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bayestouch.data.dataset import DataSet, require_dataset
from bayestouch.data.splits import with_calibration
from bayestouch.errors import InputError, about, not_a, require_whole
from bayestouch.model.body import body_of
from bayestouch.output.progress import Progress, require_progress
from bayestouch.priors.parameters import Prior
from bayestouch.priors.stated import require_priors
from bayestouch.results.objects import Calibration
from bayestouch.results.schema import chosen_groups

if TYPE_CHECKING:
    from bayestouch.effects.stated import StatedModel

__all__ = ["calibrate"]


def calibrate(
    dataset: DataSet,
    *,
    contact: str | None = None,
    e_map: str | None = None,
    discrepancy: str | None = None,
    kernel: str | None = None,
    priors: Mapping[str, Prior] | None = None,
    like: Calibration | str | Path | Sequence[Calibration | str | Path] = (),
    model: StatedModel | str | Path | None = None,
    moves: Any = None,
    draws: int = 1000,
    groups: str | Sequence[str] = (),
    seed: int = 0,
    progress: Progress | None = None,
) -> Calibration:
    """Calibrate a sensor from touches with known indenter, location and load.

    Parameters
    ----------
    dataset : DataSet
        Sensor and touches. Without calibration touches the touches are split, and the notes say how.
    contact : {"layer", "hertz", "approximate frictionless"}, optional
        Contact model of a finger; the exact contact on the bonded layer by default. A pad has none: its kernel
        describes contact and body together.
    e_map : {"auto", "model", "empirical"}, optional
        E map of a finger: that of the elastic model (``"model"``, default), or one that is identified from the
        readings, with a prior centred on the elastic model. Effects are first fitted with the elastic model; the map is
        then identified from the signals before the effects. No correction is added to an identified map, because the
        map includes it. On a pad: the kernel alone (``"model"``), an empirical map in addition to the kernel
        (``"empirical"``), or the one that predicts left-out readings better (``"auto"``, default). A correction of a
        pad is an empirical map, so that ``"model"`` has none.
    discrepancy : {"auto", "none", "touch", "place"}, optional
        Discrepancy of a finger. ``"none"``: no discrepancy. ``"touch"``: an error of each element that is independent
        from touch to touch. ``"place"``: the same error, and smooth functions of the location (Gaussian processes: E
        map of each element, readings of each element, curvature of the surface). By default ``"touch"`` and ``"place"``
        are compared, and the one that predicts held-out locations better is used; see docs/statistics.md. With effects,
        or with an empirical E map, it is ``"touch"``.
    kernel : {"auto", "layer", "layer-line", "half-space", "half-space-line", "gaussian", "constant"}, optional
        Kernel of a pad; chosen by cross-validation on the calibration touches by default. ``"layer-line"`` and
        ``"half-space-line"`` are for elements in a line only, with loads that are long across this line.
        ``"constant"`` is 1 everywhere, so that an empirical map alone describes the response over location.
    priors : mapping of str to Prior, optional
        Priors in place of the default ones, by name of the parameter. Of a finger: ``sigma``, ``mu`` (MPa), ``r_s``
        (mm), ``theta_s`` (difference from the nominal angle, degree), ``response`` (absolute value, reading per N/m),
        ``noise_sd`` (of one raw reading), ``discrepancy_sd`` (multiple of the noise of a touch's mean) and
        ``force_noise_sd`` (N/m). Of a pad: the parameters of its kernel (``h``, ``z``, ``a``, ``w`` in mm,
        ``depth_share``, ``sigma``), ``gain`` (reading per unit load), ``offset`` (reading without touch, minus the rest
        reading), ``x_s`` and ``y_s`` (difference from the nominal place, mm; all nominal places are first moved to
        where readings peak, see the notes). The prior of a parameter of each element applies to every element. A pad
        takes normal, uniform and log-normal priors. See `bayestouch.priors.parameters` for the kinds.
    like : Calibration or path, or sequence of these, optional
        Calibrations of earlier fingers of the same build. Priors of ``sigma``, ``mu``, ``r_s``, ``response``,
        ``noise_sd`` and ``discrepancy_sd`` are learned from them, see `bayestouch.finger.learned_priors`; `priors`
        replaces these.
    model : StatedModel or path, optional
        Effects of the sensor, or the ``model.toml`` of a diagnosis. The values of the effects are estimated together
        with the other parameters. A model without effects and correction gives the same calibration as a call without
        `model`. If `contact` is given, it replaces that of the model.
    moves : emcee.moves.Move or list, optional
        Moves for a finger, as in `emcee.EnsembleSampler`, instead of independence chains. Ensembles of walkers take
        much longer: minutes for sixteen elements.
    draws : int
        Number of posterior draws to keep, at least 8. Chains of a finger have at least 200 draws. Touches are read with
        the covariance of all of them, which more draws tell more precisely: from 200 draws to 20,000, means of R move
        by up to 0.1 sd, and standard deviations by up to 4 %.
    groups : str or sequence of str
        Further groups of the ArviZ schema: some of ``"log_likelihood"`` (of each touch), ``"log_prior"``, ``"prior"``,
        ``"prior_predictive"``, ``"posterior_predictive"``, or ``"all"``. A pad with effects has no predictions. A
        finger with drifts or corrections has only ``"log_prior"`` and ``"prior"``, one with an identified E map has
        none. Predictions take 4 bytes for each draw, touch and element: 64 MB for
        1,000 touches of 16 elements with 1,000 draws; log likelihoods 8 bytes for each draw and touch.
    seed : int
        Seed of every random number.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        An option does not fit the body or another option, `draws` is below 8, a calibration in `like` is of another
        build or of these touches, something in `priors` is no prior, a prior contradicts the possible range or the
        nominal geometry, or the touches cannot identify the parameters.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> mean, sd, unit = calibration.summary().loc["mu", ["mean", "sd", "unit"]]
    >>> round(float(mean), 2), unit  # shear modulus of the rubber
    (0.15, 'MPa')
    >>> calibration.posterior["sigma"].shape  # draws of Poisson's ratio: chains, draws
    (4, 50)
    """
    require_whole("draws", draws, 8)
    require_whole("seed", seed, 0)
    require_dataset(dataset)
    body = body_of(dataset.sensor)
    require_progress(progress)
    require_priors(priors)
    if discrepancy == "none" and "discrepancy_sd" in (priors or {}):
        raise InputError('prior of discrepancy_sd: discrepancy "none" has no such parameter')
    chosen = chosen_groups(groups) or None
    one = Calibration | str | Path
    if not isinstance(like, one | Sequence):
        raise not_a("a calibration, its path, or a list of these", like, "bayestouch.load reads a calibration")
    earlier = (like,) if isinstance(like, one) else tuple(like)
    for each in earlier:
        if not isinstance(each, one):
            raise not_a("a list of calibrations or their paths", each, "bayestouch.load reads a calibration")
    given = {
        "contact": contact,
        "e_map": e_map,
        "discrepancy": discrepancy,
        "priors": priors or None,
        "like": earlier or None,
        "kernel": kernel,
        "groups": chosen,
        "moves": moves,
    }
    own = body.own(given)
    if moves is not None:
        from bayestouch.sampling.moves import require_moves

        require_moves(moves)
    model = _model(model)
    common: dict[str, Any] = {"draws": draws, "seed": seed, "progress": progress}
    with about(dataset.path):
        if model is not None:
            if model.body != body.kind:
                reason = f"the model is that of a {model.body}, this sensor is a {body.kind}"
                raise InputError(reason, file=model.path, column="body")
            own = body.own({**given, "contact": contact or model.contact or None})
        from bayestouch.calibration.like import LikeEarlier

        learned = LikeEarlier.of(body, own, dataset)
        own = learned.options
        if model is None or not (model.effects or model.correction):
            return learned.noted(body.calibrate(with_calibration(dataset), **own, **common))
        if own.pop("discrepancy", None) not in (None, "auto", "touch"):
            raise InputError("discrepancy: with effects it is independent from touch to touch")
        from bayestouch.calibration.with_effects import calibrate_with_effects

        return learned.noted(calibrate_with_effects(dataset, model, **own, **common))


def _model(given: StatedModel | str | Path | None) -> StatedModel | None:
    from bayestouch.effects.stated import StatedModel, read_model

    if isinstance(given, str | Path):
        return read_model(given)
    if not isinstance(given, StatedModel | None):
        raise not_a("a StatedModel or the path of a model.toml", given, "bayestouch.effects.read_model reads one")
    return given
