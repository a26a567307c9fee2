"""Calibration of a pad from touches with known location."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from bayestouch.chain.kernel_choice import kernel_names
from bayestouch.chain.pad_map import PadMap
from bayestouch.data.dataset import DataSet
from bayestouch.data.sensor import Sensor, pad_of
from bayestouch.data.splits import with_calibration
from bayestouch.errors import InputError, nearest, unknown_name
from bayestouch.output.progress import Progress, staged
from bayestouch.pad.added_noise import NoiseWithEffects
from bayestouch.pad.candidates import PadCandidate, with_noise_between_blocks
from bayestouch.pad.choice import choose_model
from bayestouch.pad.density import PadDensity
from bayestouch.pad.known_touches import SAMPLES
from bayestouch.pad.posterior import PadPosterior
from bayestouch.pad.priors import used_priors
from bayestouch.pad.problem import OfLoads, PadProblem, pad_problem
from bayestouch.pad.result import pad_calibration_of
from bayestouch.pad.start import fit_without_effects
from bayestouch.priors.parameters import Prior
from bayestouch.results.keys import STATED_MAP, STATED_PRIORS
from bayestouch.results.objects import Calibration

# Share of the processing time that the choice of the model takes.
CHOSEN = 0.7


def calibrate_pad(
    dataset: DataSet,
    *,
    kernel: str = "auto",
    empirical: bool | Literal["auto"] = "auto",
    stated: Mapping[str, Prior] | None = None,
    samples: str = "auto",
    draws: int = 1000,
    groups: Sequence[str] = (),
    seed: int = 0,
    progress: Progress | None = None,
) -> Calibration:
    """Calibrate a pad: gains, offsets, positions, kernel, empirical map and noise.

    Three models are compared by the log predictive density of readings that are left out one by one: the best kernel,
    this kernel with an empirical map, and an empirical map about a constant. The simplest one that is not clearly worse
    is chosen. emcee draws its parameters from the exact posterior, with the map integrated out; the proposals are those
    of `bayestouch.pad.sampling`.

    Parameters
    ----------
    dataset : DataSet
        Data set of a pad. Without a calibration table, the touches are first split by location.
    kernel : str
        One of `bayestouch.chain.kernel_choice.kernel_names`, or ``"auto"``.
    empirical : bool or "auto"
        Whether the model has an empirical map.
    stated : mapping of str to Prior, optional
        Priors stated by the user; see `PadPriors.with_stated`.
    samples : {"auto", "mean", "first", "last"}
        Samples of a touch that are used; see `bayestouch.pad.known_touches.choose_samples`.
    draws : int
        Number of posterior draws, over all chains.
    groups : sequence of str
        Groups of the ArviZ schema: ``"log_likelihood"``, ``"log_prior"``.
    seed : int
        Seed of the random numbers.
    progress : callable, optional
        Called with the share done, 0 to 1.

    Returns
    -------
    Calibration
        ``rows.predicted`` is the prediction of each reading from all others, ``rows.sd`` its sd with the noise.

    Raises
    ------
    InputError
        The touches cannot identify the parameters, or an option has an unknown value.
    """
    choosing = staged(progress, 0.0, CHOSEN, "choose a kernel")
    chosen = choose_pad(
        dataset, kernel=kernel, empirical=empirical, stated=stated, samples=samples, seed=seed, progress=choosing
    )
    chosen, posterior = drawn(
        chosen, dataset, draws=draws, groups=groups, seed=seed, progress=staged(progress, CHOSEN, 1.0, "draw")
    )
    return chosen.calibration(dataset.sensor, posterior)


def drawn(
    chosen: ChosenPad,
    dataset: DataSet,
    *,
    draws: int,
    seed: int,
    groups: Sequence[str] = (),
    progress: Progress | None = None,
) -> tuple[ChosenPad, PadPosterior]:
    """The chosen model at its most probable parameters, and posterior draws of the parameters."""
    fitted = fit_without_effects(chosen.problem, chosen.model, pad_of(dataset.sensor))
    density = PadDensity.of(fitted)
    posterior = PadPosterior.of(density, draws, seed, groups=groups, progress=progress)
    return replace(chosen, model=chosen.model.at(density.values(density.mode), posterior.covariance)), posterior


@dataclass(frozen=True, eq=False)
class ChosenPad:
    """Known touches of a pad, the model that was chosen for them, and all models that were fitted to them.

    Attributes
    ----------
    problem : PadProblem
        The touches.
    name : str
        Name of the chosen model.
    model : PadCandidate
        The chosen model.
    rivals : dict of str to PadCandidate
        All fitted models by name, the chosen one included.
    notes : list of str
        Notes on touches that were left out, and on assumptions.
    empirical : bool or "auto"
        Whether an empirical map was asked for.
    """

    problem: PadProblem
    name: str
    model: PadCandidate
    rivals: dict[str, PadCandidate]
    notes: list[str]
    empirical: bool | Literal["auto"] = "auto"

    def calibration(self, sensor: Sensor, posterior: PadPosterior, *, map_: PadMap | None = None) -> Calibration:
        """The calibration with a posterior; touches are read with `map_`, by default with that of the model."""
        made = pad_calibration_of(sensor, self.problem, self.name, self.model, self.rivals, posterior, self.notes, map_)
        used, _ = used_priors(self.problem.priors.stated, self.model.fit.chain)
        stated = {STATED_PRIORS: ", ".join(used)}
        if self.empirical != "auto":
            stated[STATED_MAP] = "empirical" if self.empirical else "model"
        return replace(made, settings={**made.settings, **{key: text for key, text in stated.items() if text}})


def choose_pad(
    dataset: DataSet,
    *,
    kernel: str,
    empirical: bool | Literal["auto"] = "auto",
    stated: Mapping[str, Prior] | None = None,
    samples: str = "auto",
    seed: int = 0,
    progress: Progress | None = None,
    relative_slope: OfLoads | None = None,
    noise: NoiseWithEffects | None = None,
    earlier: Mapping[str, PadCandidate] | None = None,
) -> ChosenPad:
    """Choose the model of a pad; parameters and errors as in `calibrate_pad`.

    `relative_slope` and `noise` are those of `pad_problem`, `earlier` is that of `choose_model`.
    """
    dimensions = pad_of(dataset.sensor, "a calibration with kernels").dimensions
    if samples not in SAMPLES:
        raise InputError(f"samples: expected {' or '.join(SAMPLES)}, got {samples!r}{nearest(str(samples), SAMPLES)}")
    if kernel != "auto" and kernel not in kernel_names(dimensions):
        raise unknown_name("kernel", kernel, ("auto", *kernel_names(dimensions)))
    dataset = with_calibration(dataset)
    assert dataset.calibration is not None
    problem, notes = pad_problem(
        dataset.sensor,
        dataset.calibration,
        samples=samples,
        seed=seed,
        kernel=kernel,
        stated=stated,
        relative_slope=relative_slope,
        noise=noise,
    )
    model, rivals = choose_model(problem, dataset, kernel, empirical, progress, earlier)
    name = next(name for name, rival in rivals.items() if rival is model)
    _, unused = used_priors(problem.priors.stated, model.fit.chain)
    notes = [*dataset.notes, *dataset.calibration.notes, *notes, *unused]
    return ChosenPad(problem, name, with_noise_between_blocks(problem, model), rivals, notes, empirical)
