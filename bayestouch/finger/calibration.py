"""`Calibration` of a finger without effects."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import BoolArray, FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.data.averages import TouchMeans
from bayestouch.data.baseline import NO_REST
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Sensor, finger_of
from bayestouch.errors import InputError
from bayestouch.finger.fit import FingerFit, fit_finger, with_offsets, without_offsets
from bayestouch.finger.known_touches import KnownTouches
from bayestouch.finger.lacking import shear_modulus_from_prior
from bayestouch.finger.noise import noise_of
from bayestouch.finger.place.choice import LEAST_PLACES
from bayestouch.finger.place.fit import AUTO, DISCREPANCY_SETTING, NO_DISCREPANCY, OF_PLACE, OF_TOUCH, fit_of_places
from bayestouch.finger.place.posterior import PlacePosterior
from bayestouch.finger.polarity import other_polarity
from bayestouch.finger.priors import FingerPriors
from bayestouch.finger.public import linear_vectors, public_draws, public_mode
from bayestouch.finger.requested import FitGroups
from bayestouch.finger.sampling import sample_fit
from bayestouch.finger.start import base_fit
from bayestouch.model.fitting import Fitted
from bayestouch.model.requested import groups_of_draws
from bayestouch.model.rest_errors import rest_errors
from bayestouch.model.split_data import CORRECTED_REST, SplitData
from bayestouch.output.progress import Progress
from bayestouch.output.text import those_with
from bayestouch.priors.far_from_priors import far_from_priors
from bayestouch.priors.parameters import Prior
from bayestouch.results.data import TouchRows
from bayestouch.results.keys import E_MAP, IDENTIFIED_MAP, MODEL_MAP, REST_READING
from bayestouch.results.objects import Calibration
from bayestouch.results.schema import LOG_DENSITY
from bayestouch.sampling.draws import thinned
from bayestouch.version import __version__


def about_offsets(notes: Sequence[str], *, fitted: bool = False) -> tuple[str, ...]:
    """Notes of a calibration; that of readings without a rest reading says what it means on a finger.

    `fitted` says that the offset of each element is an effect of the model.
    """
    what = "the offset of each element is fitted"
    if not fitted:
        what = "a finger has no offset, so they must be zero without touch (a diagnosis looks for an offset)"
    return tuple(f"{NO_REST}; {what}" if note == NO_REST else note for note in notes)


def calibrate_finger(
    dataset: DataSet,
    *,
    contact: str,
    e_map: str = "model",
    discrepancy: str = AUTO,
    draws: int,
    seed: int,
    stated: Mapping[str, Prior] | None = None,
    groups: Sequence[str] = (),
    progress: Progress | None = None,
    moves: Any = None,
) -> Calibration:
    """Calibrate a finger; see `bayestouch.calibrate`.

    First the mode and the normal (Laplace) approximation at the mode are computed. Then emcee draws from the exact
    joint posterior of the parameters of the chain and of the noise, with proposals from this normal distribution.
    """
    require_likelihood(groups, e_map)
    sensor, table = dataset.sensor, dataset.calibration
    finger = finger_of(sensor)
    assert table is not None
    priors, notes = FingerPriors.of(sensor)
    priors = priors.with_stated(stated or {}, finger)
    if discrepancy == NO_DISCREPANCY:
        priors = replace(priors, discrepancy=None)
    rest = table.rest_reading()
    corrected = table.baseline_corrected()
    means = corrected.averaged()
    if means.n_touches == 0:
        raise InputError(
            "no calibration touch is in contact (contact, depth or load is 0 in every row), so that nothing of the "
            "sensor is identifiable: give touches with a load",
            file=_file(dataset),
        )
    elastic, used = fit_finger(means, finger, priors, contact=contact)
    offsets = None
    if rest is not None:
        data = _settled_rest(dataset, np.isin(table.touch, means.touch[used]), contact, stated)
        rest, offsets = data.rest, data.rest_offsets(data.table.averaged().touch)
    if offsets is not None:
        means = replace(means, readings=means.readings - offsets.removed)
        corrected = corrected.with_(notes=(*corrected.notes, CORRECTED_REST)) if offsets.removed.any() else corrected
        elastic, used = fit_finger(means, finger, priors, contact=contact)
        elastic = with_offsets(elastic, offsets.select(used))
    fit = elastic
    places: PlacePosterior | None = None
    why: tuple[str, ...] = ()
    if discrepancy in (AUTO, OF_PLACE) and e_map == "model":
        fit, places, why = fit_of_places(elastic, wanted=discrepancy == OF_PLACE)
    if places is None and discrepancy == OF_PLACE:
        raise InputError(
            f'discrepancy "{OF_PLACE}" needs the E map of the model, and calibration touches at {LEAST_PLACES} places '
            f'or more: touch more places, or use the discrepancy "{OF_TOUCH}"',
            file=_file(dataset),
        )
    calibration = finger_calibration(
        fit,
        means,
        used,
        sensor=sensor,
        priors=priors,
        rest=rest,
        draws=draws,
        seed=seed,
        notes=(*dataset.notes, *table.notes, *corrected.notes, *notes, *why),
        places=places,
        groups=groups,
        progress=progress,
        moves=moves,
    )
    if discrepancy == NO_DISCREPANCY:
        calibration = replace(calibration, settings={**calibration.settings, DISCREPANCY_SETTING: NO_DISCREPANCY})
    if places is not None:
        # The lack of fit of the elastic model is stored too: functions of place reduce it, and a cause would be hidden.
        both = {"lack_of_fit": elastic.lack_of_fit, "lack_of_fit_of_place": fit.lack_of_fit}
        calibration = replace(calibration, statistics={**calibration.statistics, **both})
    return calibration if e_map == "model" else with_identified_map(calibration, without_offsets(fit))


def _settled_rest(dataset: DataSet, used: BoolArray, contact: str, stated: Mapping[str, Prior] | None) -> SplitData:
    """The calibration touches without the errors of a rest reading that they share, if these are not negligible.

    `used` are the rows (n,) of touches that can be fitted.
    """
    data = SplitData.of_calibration(dataset)
    if not (data.rest_source[used] >= 0).any():
        return data
    fitted = base_fit(data.observations(data.training & used), dataset.sensor, contact, stated)
    errors = rest_errors(fitted, data)
    return data if errors is None else data.without_rest_errors(errors)


def require_likelihood(groups: Sequence[str], e_map: str) -> None:
    """Raise an error if groups are asked for that an E map does not have.

    Raises
    ------
    InputError
        There are groups, and the E map is identified.
    """
    if groups and e_map != MODEL_MAP:
        raise InputError("groups: draws of the elastic finger have no likelihood of an identified E map")


def finger_calibration(
    fit: FingerFit,
    means: TouchMeans,
    used: NDArray[np.bool_],
    *,
    sensor: Sensor,
    priors: FingerPriors,
    rest: FloatArray | None,
    draws: int,
    seed: int,
    notes: tuple[str, ...],
    places: PlacePosterior | None = None,
    groups: Sequence[str] = (),
    progress: Progress | None = None,
    moves: Any = None,
) -> Calibration:
    """Calibration of a fitted finger without effects, with posterior draws by emcee.

    Parameters
    ----------
    fit : FingerFit
        The fit.
    means : TouchMeans
        Mean readings of t touches.
    used : (t,) bool array
        Touches that were used in the fit.
    sensor : Sensor
        The finger, with its nominal dimensions.
    priors : FingerPriors
        Priors of the fit.
    rest : (m,) array or None
        Rest reading that was subtracted.
    draws, seed, groups, progress, moves
        As in `bayestouch.calibrate`.
    notes : tuple of str
        Notes; those on the noise and on touches that are left out are added.
    places : PlacePosterior, optional
        Functions of place that were fitted with the finger.
    """
    made = sample_fit(fit, draws, seed, progress, moves)
    drawn = thinned(made, draws)
    every, vectors = made.draws[:, :, 0], drawn.draws[:, :, 0]
    touches, layout_ = fit.likelihood.known, fit.likelihood.layout
    assert means.angle_deg is not None
    rows = TouchRows(
        touch=means.touch[used],
        location={"theta_c": fit.likelihood.model.finger.near(means.angle_deg[used])},
        radius_mm=means.indenter_radius_mm[used],
        load=means.load[used],
        # Nothing is learnt from an element that always reads the same: its readings count as missing.
        observed=np.where(touches.missing, np.nan, means.readings[used]),
        predicted=fit.predicted,
        sd=fit.sd,
        counts=touches.counts,
        samples=means.samples[used],
        load_reads=means.reads_of_load[used],
    )
    posterior = public_draws(fit, vectors)
    typical = float(np.nanmean(rows.load))
    log_mu = layout_.log_mu
    from_prior = shear_modulus_from_prior(every[..., log_mu], float(fit.likelihood.prior.spread[log_mu]))
    covariance = np.cov(linear_vectors(layout_, fit.likelihood.sign, every).T)
    extra = {} if rest is None else {REST_READING: rest}
    if places is not None:
        extra |= places.with_model_covariance(covariance).arrays()
    return Calibration(
        sensor=sensor,
        parameters=priors.parameters(sensor.reading_unit, discrepancy=layout_.discrepancy),
        mode=public_mode(fit),
        posterior=posterior,
        covariance=covariance,
        layout=layout(layout_.n_elements),
        noise=noise_of(touches, layout_, every.reshape(-1, every.shape[-1])),
        rows=rows,
        settings={
            "body": "finger",
            "contact": fit.chain.contact,
            E_MAP: MODEL_MAP,
            "seed": float(seed),
            "version": __version__,
            "largest_load": fit.chain.largest_load,
            "typical_load": typical,
        },
        statistics={
            **_statistics(fit, rows, typical),
            "ess_bulk": float(drawn.ess_bulk.min()),
            "rhat": float(drawn.rhat.max()),
            "acceptance": float(drawn.acceptance.min()),
        },
        extra=extra,
        notes=tuple(
            dict.fromkeys(
                (
                    *about_offsets(notes),
                    *_noise_notes(touches, priors),
                    *from_prior,
                    *_left_out(used),
                    *other_polarity(fit.chain.response, rows.observed),
                    *far_from_stated(priors, sensor, posterior),
                )
            )
        ),
        groups={
            "sample_stats": {LOG_DENSITY: drawn.log_density[:, :, 0]},
            **groups_of_draws(FitGroups(fit), vectors, groups, seed),
        },
    )


def far_from_stated(priors: FingerPriors, sensor: Sensor, posterior: Mapping[str, FloatArray]) -> Iterator[str]:
    """Yield the notes of `far_from_priors` on the parameters of a finger without effects, from draws by name."""
    nominal = {"theta_s": finger_of(sensor).element_angles_deg}
    yield from far_from_priors(priors.parameters(sensor.reading_unit, discrepancy=False), posterior, nominal)


def with_identified_map(calibration: Calibration, fit: FingerFit | Fitted) -> Calibration:
    """The calibration with an E map that is identified by regression, with the elastic E map as prior mean."""
    from bayestouch.finger.empirical.calibration import fit_empirical
    from bayestouch.finger.empirical.with_effects import identify_beside_effects

    if isinstance(fit, FingerFit):
        identified = fit_empirical(fit)
    else:
        shared = slice(3 * calibration.sensor.n_elements, None)
        identified = identify_beside_effects(fit, calibration.noise, calibration.covariance[shared, shared])
    # Nothing is known of the fit of an element without readings.
    read = (calibration.rows.counts > 0).any(axis=0)
    lack_of_fit = float(np.mean(identified.lack_of_fit[read]))
    notes = calibration.notes
    if lack_of_fit > 1.5:
        notes += (
            f"Lack of fit stays at {lack_of_fit:.2f} with the identified E map: what is missing is not a smooth "
            "function of element and location in proportion to the load. It may change with time or load, with the "
            "width of the contact, or from place to place faster than the map; readings with the map may be wrong.",
        )
    return replace(
        calibration,
        noise=identified.calibration.noise,
        rows=replace(calibration.rows, predicted=identified.predicted, sd=identified.sd),
        settings={**calibration.settings, E_MAP: IDENTIFIED_MAP},
        statistics={**calibration.statistics, "lack_of_fit_empirical": lack_of_fit},
        extra={**calibration.extra, **identified.calibration.arrays()},
        notes=notes,
    )


def layout(n_elements: int) -> tuple[str, ...]:
    """Names of the rows of the covariance of a finger (angles in rad, μ as its logarithm)."""
    by_element = [f"{name}[{e}]" for name in ("response", "r_s", "theta_s_rad") for e in range(n_elements)]
    return (*by_element, "sigma", "log_mu")


def finger_chain(calibration: Calibration) -> FingerChain:
    """The elastic finger at the mode of its calibration."""
    finger = finger_of(calibration.sensor)
    mode = calibration.mode
    return FingerChain(
        core_radius_mm=finger.core_radius_mm,
        outer_radius_mm=finger.outer_radius_mm,
        response=np.asarray(mode["response"]),
        sensing_radius_mm=np.asarray(mode["r_s"]),
        angle=np.radians(mode["theta_s"]),
        offset=np.zeros(finger.n_elements),
        poisson_ratio=float(mode["sigma"]),
        shear_modulus_MPa=float(mode["mu"]),
        largest_load=float(calibration.settings["largest_load"]),
        contact=str(calibration.settings["contact"]),
    )


def _file(dataset: DataSet) -> str | None:
    return None if dataset.path is None else str(dataset.path)


def _noise_notes(known: KnownTouches, priors: FingerPriors) -> tuple[str, ...]:
    """Notes on the parts of the noise that the touches do not determine and that depend on the prior."""
    notes = []
    if not known.repeated:
        notes.append(
            "Not every element was read twice in a touch, or its samples are all equal: model error and noise cannot "
            "be distinguished, and all of it counts as noise."
        )
    if known.force_scatter_dof == 0:
        source = "as stated" if priors.force_noise else "as assumed"
        notes.append(
            f"No touch has repeated loads: the force sensor's noise is known from its prior, {source}, and from the "
            "common errors of the elements."
        )
    if (known.load_reads == 0).any():
        count = int((known.load_reads == 0).sum())
        notes.append(f"{those_with(count, 'calibration touch')} no measured load: it is inferred with the rest.")
    return tuple(notes)


def _left_out(used: NDArray[np.bool_]) -> tuple[str, ...]:
    if used.all():
        return ()
    return (f"{int((~used).sum())} calibration touches without known indenter, location or a load were left out.",)


def _statistics(fit: FingerFit, rows: TouchRows, typical_load: float) -> dict[str, float]:
    peak = np.abs(fit.chain.response) * typical_load
    present = ~np.isnan(rows.observed)
    squares = np.where(present, rows.observed - rows.predicted, 0.0) ** 2
    alive = present.any(axis=0)
    error = np.sqrt(squares.sum(axis=0)[alive] / present.sum(axis=0)[alive]) / peak[alive] * 100
    return {
        "touches": float(len(rows.touch)),
        "lack_of_fit": fit.lack_of_fit,
        "error_percent_peak": float(error.mean()),
        "noise_percent_peak": float((fit.noise.tactile_sd / peak)[alive].mean() * 100),
    }
