"""Simulation-based calibration of the calibration posterior of a finger.

Each simulation draws all parameters from their priors, simulates the calibration touches, calibrates, and computes the
rank of the truth among the posterior draws. Truth, noise and readings are computed here from the public parameters,
independently of the noise, layout and prior densities of the likelihood.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bayestouch.array_types import FloatArray
from bayestouch.calibration import calibrate
from bayestouch.calibration.log_density import log_density
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.recording import Recording
from bayestouch.contact import composite_radius
from bayestouch.data.averages import TouchMeans
from bayestouch.data.dataset import DataSet
from bayestouch.data.grouping import grouped_mean, groups
from bayestouch.data.sensor import Finger, Sensor, finger_of
from bayestouch.data.touches import Touches
from bayestouch.effects.stated import StatedModel
from bayestouch.errors import InputError
from bayestouch.finger.density import FingerDensity
from bayestouch.finger.fit import FingerFit, fit_finger
from bayestouch.finger.likelihood import LOAD_REACH, too_soft
from bayestouch.finger.priors import FIELDS, FingerPriors
from bayestouch.finger.softest_rubber import softest
from bayestouch.priors.parameters import LEAST_MASS, LogNormal, Prior
from bayestouch.simulation_based_calibration.effects import SimulatedEffects, known_touches
from bayestouch.simulation_based_calibration.running import Ranked, by_element, ranks_of

# If the user states no prior, responses and noise are within these factors of those of the data set.
RESPONSE_FACTOR, NOISE_FACTOR = 1.3, 1.5


@dataclass(frozen=True, eq=False)
class CalibrationDesign:
    """Calibration touches to be simulated, and the priors of their parameters.

    Attributes
    ----------
    sensor : Sensor
        The finger as built.
    drawn_from : mapping of str to Prior
        Priors of the simulated truth, for all parameters, by the names of `bayestouch.calibrate`.
    assumed : mapping of str to Prior
        Priors that the calibration uses.
    touches : Touches
        Samples of which locations, indenters and mean loads are used.
    contact : str
        Contact model.
    draws : int
        Number of posterior draws of each simulation.
    seed : int
        Seed of all random numbers.
    added : SimulatedEffects
        Effects, with the priors from which their values are drawn.
    """

    sensor: Sensor
    drawn_from: Mapping[str, Prior]
    assumed: Mapping[str, Prior]
    touches: Touches
    contact: str
    draws: int
    seed: int
    added: SimulatedEffects = field(default_factory=SimulatedEffects)

    @classmethod
    def of(
        cls,
        dataset: DataSet,
        stated: Mapping[str, Prior],
        contact: str,
        draws: int,
        seed: int,
        effects: Sequence[str] = (),
    ) -> CalibrationDesign:
        """Return the design for a data set; priors that are not stated follow from its sensor and readings."""
        finger, table = finger_of(dataset.sensor, "simulation-based calibration without `kernel`"), dataset.calibration
        if table is None:
            raise InputError("simulation-based calibration needs a data set with calibration touches")
        touches = known_touches(table)
        default = FingerPriors.of(dataset.sensor)[0]
        fit, used = fit_finger(touches.averaged(), finger, default, contact=contact)
        if not used.all():
            raise InputError("simulation-based calibration needs touches that are all known")
        own = {
            "response": LogNormal(float(np.median(np.abs(fit.chain.response))), float(np.log(RESPONSE_FACTOR))),
            "noise_sd": LogNormal(float(np.median(fit.noise.tactile_sd)), float(np.log(NOISE_FACTOR))),
            "force_noise_sd": LogNormal(fit.noise.force_sd, float(np.log(NOISE_FACTOR))),
        }
        complete = default.with_stated(stated, finger)
        priors = {name: getattr(complete, field) or own[name] for name, field in FIELDS.items()}
        design = cls(dataset.sensor, priors, priors, touches, contact, draws, seed)
        if not effects:
            return design
        known = DataSet(dataset.sensor, touches, touches)
        return replace(design, added=SimulatedEffects.of(effects, known, contact, fit.likelihood.known.typical_load))

    @property
    def model(self) -> StatedModel | None:
        """Effects that are given to a calibration; None without effects."""
        return self.added.stated(self.sensor.body.kind, self.contact)

    def ranked(self, number: int) -> Ranked:
        """Ranks of one simulation, see `simulate_and_rank`."""
        return simulate_and_rank(self, number)

    @property
    def finger(self) -> Finger:
        """Geometry as built."""
        return finger_of(self.sensor)


def simulate_and_rank(design: CalibrationDesign, number: int) -> Ranked:
    """Return by name the rank of the truth in one simulated calibration, and if the 90 % interval contains it."""
    rng = np.random.default_rng([design.seed, number])
    true, loads, touches = simulate_calibration(design, rng)
    calibration = calibrate(
        DataSet(design.sensor, touches, touches),
        contact=design.contact,
        priors=design.assumed,
        model=design.model,
        draws=design.draws,
        seed=design.seed + number,
    )
    public = {name: values.reshape(-1, *values.shape[2:]) for name, values in calibration.posterior.items()}
    drawn, truth = by_element(public), by_element({name: true[name][None] for name in public})
    if design.added.effects:
        density = log_density(calibration, DataSet(design.sensor, touches, touches))
        drawn["log density"] = density(density.from_parameters(public))
        truth["log density"] = density(density.from_parameters({name: true[name][None] for name in public}))
        return ranks_of(drawn, truth)
    fit, _ = fit_finger(
        touches.averaged(),
        design.finger,
        FingerPriors.of(design.sensor)[0].with_stated(design.assumed, design.finger),
        contact=design.contact,
    )
    density_of_fit, flat = FingerDensity.of(fit), flat_vectors(fit, public)
    at_truth = flat_vectors(fit, {name: true[name][None] for name in public})
    drawn["log density"], truth["log density"] = density_of_fit(flat), density_of_fit(at_truth)
    centre, sd = density_of_fit.true_loads(flat)
    for label, touch in (("P of the first touch", 0), ("P of the last touch", -1)):
        drawn[label], truth[label] = rng.normal(centre[:, touch], sd[:, touch]), loads[[touch]]
    return ranks_of(drawn, truth)


def flat_vectors(fit: FingerFit, public: Mapping[str, FloatArray]) -> FloatArray:
    """Return the vectors (n, d) for the log density of a fit, from parameters in public units (n[, m])."""
    at = fit.likelihood.layout
    out = np.empty((len(public["sigma"]), at.size))
    out[:, at.response], out[:, at.depth] = np.log(np.abs(public["response"])), public["r_s"]
    out[:, at.angle], out[:, at.sigma] = np.radians(public["theta_s"]), public["sigma"]
    out[:, at.log_mu], out[:, at.noise] = np.log(public["mu"]), np.log(public["noise_sd"])
    out[:, at.force_noise] = np.log(public["force_noise_sd"])
    if at.discrepancy:
        reads = fit.likelihood.known.typical_reads
        out[:, at.log_discrepancy] = np.log(public["discrepancy_sd"] / public["noise_sd"] * np.sqrt(reads))
    return out


def simulate_calibration(
    design: CalibrationDesign, rng: np.random.Generator
) -> tuple[dict[str, FloatArray], FloatArray, Touches]:
    """Return parameters drawn from their priors, true loads (t,) and simulated samples of the design's touches.

    In the posterior the prior of each load is uniform. This is equivalent to a fixed measured mean with the true load
    scattered about it, as loads are drawn here.

    Parameters
    ----------
    design : CalibrationDesign
        Touches and priors.
    rng : numpy Generator
        Source of all random numbers.

    Returns
    -------
    dict of arrays
        Parameters by public name and in public units, shape () or (m,).
    (t,) array
        True loads, N/m.
    Touches
        The design's touches with new readings and loads.
    """
    touches = design.touches
    ids, group = groups(touches.touch)
    means = touches.averaged()
    reads = np.bincount(group, minlength=len(ids))
    true = draw_parameters(design, float(np.median(means.counts[means.counts > 0])), rng)
    loads = rng.normal(means.load, true["force_noise_sd"] / np.sqrt(reads))
    chain = FingerChain(
        core_radius_mm=design.finger.core_radius_mm,
        outer_radius_mm=design.finger.outer_radius_mm,
        response=true["response"],
        sensing_radius_mm=true["r_s"],
        angle=np.radians(true["theta_s"]),
        offset=np.zeros(design.finger.n_elements),
        poisson_ratio=float(true["sigma"]),
        shear_modulus_MPa=float(true["mu"]),
        largest_load=float(loads.max()),
        contact=design.contact,
    )
    true["gain"] = chain.gain
    assert means.angle_deg is not None
    place = composite_radius(means.indenter_radius_mm, design.finger.outer_radius_mm), np.radians(means.angle_deg)
    if design.added.effects:

        def measured(clean: FloatArray, rng: np.random.Generator) -> FloatArray:
            missed = rng.normal(0.0, true["discrepancy_sd"], (len(ids), chain.n_elements))
            readings = rng.normal(clean + missed[group], true["noise_sd"])
            return np.where(np.isnan(touches.readings), np.nan, readings)

        readings, drawn = _with_effects(design, chain, means, loads, measured, rng)
        true |= drawn
    else:
        clean = chain.predict(*place, loads)
        readings = rng.normal(rng.normal(clean, true["discrepancy_sd"])[group], true["noise_sd"])
    scatter = rng.normal(0.0, true["force_noise_sd"], len(group))
    scatter -= grouped_mean(scatter, group, len(ids))[group]
    return (
        true,
        loads,
        touches.with_(
            readings=np.where(np.isnan(touches.readings), np.nan, readings), load=means.load[group] + scatter
        ),
    )


def _with_effects(
    design: CalibrationDesign,
    chain: FingerChain,
    means: TouchMeans,
    loads: FloatArray,
    measured: Callable[[FloatArray, np.random.Generator], FloatArray],
    rng: np.random.Generator,
) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Return readings (n, m) of all samples with effects, as `measured`, and the values of the effects by name."""
    added, values = design.added, design.added.draw(rng)
    for effect, each in zip(added.effects, values, strict=True):
        chain = effect.finger(chain, each)

    def press(recording: Recording) -> FloatArray:
        radius = composite_radius(recording.indenter_radius_mm, design.finger.outer_radius_mm)
        return chain.predict(radius, np.radians(recording.place[0]), recording.load)

    assert means.angle_deg is not None
    readings = added.readings(
        values,
        design.touches,
        means,
        (np.asarray(design.finger.element_angles_deg),),
        (means.angle_deg,),
        loads,
        np.abs(chain.response) * added.reference_load,
        press,
        measured,
        rng,
    )
    return readings, added.named(values)


def draw_parameters(design: CalibrationDesign, reads: float, rng: np.random.Generator) -> dict[str, FloatArray]:
    """Return one draw of every parameter from its prior, for a rubber that can carry the loads.

    As documented, priors of angles are for deviations from the design, and the prior of the discrepancy is in units of
    the noise of the mean of a touch with `reads` readings.

    Raises
    ------
    InputError
        Nearly nothing of the prior of μ is such a rubber.
    """
    finger, m = design.finger, design.finger.n_elements
    shapes = {name: () if name in ("sigma", "mu", "force_noise_sd") else (m,) for name in FIELDS}
    largest_load = LOAD_REACH * float(design.touches.averaged().load.max())
    lowest = np.exp(softest(finger, largest_load, float(design.drawn_from["sigma"].support[0])))
    if design.drawn_from["mu"].quantile(1 - LEAST_MASS) <= lowest:
        raise too_soft(float(lowest))
    while True:
        drawn = {name: design.drawn_from[name].quantile(rng.random(shape)) for name, shape in shapes.items()}
        if drawn["mu"] > lowest:
            break
    drawn["theta_s"] = drawn["theta_s"] + np.asarray(finger.element_angles_deg)
    drawn["discrepancy_sd"] = drawn["discrepancy_sd"] * drawn["noise_sd"] / np.sqrt(reads)
    return drawn
