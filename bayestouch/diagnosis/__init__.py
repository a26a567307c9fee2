"""Diagnosis: find errors of a model, attribute them to effects, add these, and report errors before and after."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bayestouch.errors import about, require_whole
from bayestouch.output.progress import Progress, require_progress

if TYPE_CHECKING:
    from bayestouch.data.dataset import DataSet
    from bayestouch.diagnosis.result import Diagnosis

__all__ = ["diagnose"]


def diagnose(
    dataset: DataSet,
    *,
    contact: str | None = None,
    kernel: str | None = None,
    draws: int = 1000,
    sample: bool = True,
    seed: int = 0,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnosis of a sensor's model: effects that are missing from it, and errors before and after they are added.

    Parameters
    ----------
    dataset : DataSet
        Sensor and touches. The location and, on a finger, the indenter of touches must be known. Half of the touches to
        infer are held out of every fit and every decision. Without a calibration table, or with fewer than 20 such
        touches, a quarter is held out of what there is (on a pad in blocks), if there is enough.
    contact : {"layer", "hertz", "approximate frictionless"}, optional
        Contact model of a finger without effects; by default the exact contact on the bonded layer.
    kernel : str, optional
        Kernel of a pad without effects, as in `bayestouch.calibrate`; by default chosen by cross-validation.
    draws : int
        Number of draws of each calibration.
    sample : bool
        Infer the held-out touches before and after, for the errors of R, location and load and for coverage. If False,
        these are None, and the calibration after is compared with that before by its predictions of readings alone;
        everything else is the same.
    seed : int
        Seed of every random number.
    scheduler : str, optional
        Address of the scheduler of a Dask cluster that refits the best candidates of each round instead of this
        process, such as ``tcp://10.0.0.5:8786``. The result is the same.
    progress : callable, optional
        Function that is called with the fraction of the work that is done.

    Returns
    -------
    Diagnosis
        Verdict, effects with their parameters, errors before and after, calibrations before and after.

    Raises
    ------
    InputError
        If the data are not sufficient (no touch, or too few touches, have the references that a fit needs), an option
        does not fit the body, or the cluster cannot be reached.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, effects={"crosstalk": 0.05}, seed=3).dataset
    >>> diagnosis = bayestouch.diagnose(dataset, draws=200, sample=False)
    >>> diagnosis.verdict, diagnosis.effects
    ('explained', ('crosstalk',))
    >>> before, after = diagnosis.numbers["before"], diagnosis.numbers["after"]
    >>> round(before["lack_of_fit"]), round(after["lack_of_fit"])  # 1 if the model is right
    (4, 1)
    """
    from bayestouch.data.dataset import require_dataset
    from bayestouch.diagnosis.follow import trace
    from bayestouch.diagnosis.result import Diagnosis
    from bayestouch.model.body import body_of
    from bayestouch.parallel.cluster import require_address

    require_whole("draws", draws, 8)
    require_whole("seed", seed, 0)
    require_progress(progress)
    require_address(scheduler)
    require_dataset(dataset)
    body = body_of(dataset.sensor)
    options = {**body.own({"contact": contact, "kernel": kernel}), "draws": draws, "sample": sample, "seed": seed}
    with about(dataset.path):
        traced = trace(dataset, body, **options, scheduler=scheduler, progress=progress)
    return Diagnosis.of(traced, dataset, options)
