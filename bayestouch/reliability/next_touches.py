"""Which touches to make next: those that are expected to tell most, by a calibration or a diagnosis."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.data.averages import TouchMeans
from bayestouch.data.touches import Touches
from bayestouch.diagnosis.result import Diagnosis
from bayestouch.errors import InputError, nearest, shown
from bayestouch.model.body import body_of
from bayestouch.model.planned import Group
from bayestouch.model.planned_table import one_row_each, planned_table
from bayestouch.model.split_data import joined_tables
from bayestouch.output.summary import Summarised
from bayestouch.output.text import exact, number, plural
from bayestouch.reliability.candidate_touches import candidate_touches, touches_to_read
from bayestouch.reliability.choice_of_touches import ChosenTouches, lowest_sd, most_decisive
from bayestouch.reliability.two_causes import TwoCauses
from bayestouch.results.objects import Calibration
from bayestouch.results.units import load_unit

if TYPE_CHECKING:
    from pandas import DataFrame

ABOUT = ("calibration", "places", "causes")
# Number of chosen touches that the summary names.
NAMED = 4
#: The quantity of a choice between two causes.
LOG_BAYES_FACTOR = "log_bayes_factor"


@dataclass(frozen=True, eq=False, repr=False)
class NextTouches(Summarised):
    """Touches that are expected to tell most; c chosen of n candidates, g quantities.

    Attributes
    ----------
    about : str
        What the touches are to tell: ``calibration``, ``places``, or the two causes (or sets of causes) with ``or``
        between them.
    touches : Touches
        The chosen touches in the order in which they are chosen, one row each: place, tip, load, `reads`; no readings.
    chosen : (c,) int array
        Position of each chosen touch among the candidates.
    gain : (c, n) array
        Expected gain of every candidate at each step, NaN for those chosen before. For standard deviations the share
        of the mean relative variance that the touch removes (see `next_touches`); for causes the increase of the
        expected log Bayes factor, nat.
    quantities : tuple of str
        Names of the quantities: parameters, coordinates of touches, or ``log_bayes_factor``.
    units : tuple of str
        Their units.
    load_unit : str
        Unit of the loads of the touches; none where the calibration measured no loads, and they are shares of its load.
    before : (g,) array
        Expected standard deviation of each quantity before the first touch, rms over elements or places; for causes 0.
    after : (c, g) array
        The same after each chosen touch; for causes the expected log Bayes factor in favour of the right cause.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> chosen = bayestouch.next_touches(calibration, count=3)
    >>> chosen.quantities, chosen.after.shape
    (('sigma', 'mu', 'r_s'), (3, 3))
    >>> bool((chosen.after[-1] < chosen.before).all())
    True
    """

    internal: ClassVar[frozenset[str]] = frozenset({"in_words"})

    about: str
    touches: Touches
    chosen: NDArray[np.int64]
    gain: FloatArray
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    load_unit: str
    before: FloatArray
    after: FloatArray

    def to_dataframe(self) -> DataFrame:
        """Table of the chosen touches, one row each.

        Returns
        -------
        pandas.DataFrame
            Index ``touch``, the position among the candidates; ``tip`` (mm; NaN on a pad), the columns of the place,
            ``load``, ``samples``, ``gain``, and for each quantity its value after this touch (``NAME_sd``, or
            ``log_bayes_factor``). Units are in ``attrs["units"]``.
        """
        import pandas as pd

        touches = self.touches
        places = {name: getattr(touches, name) for name in ("angle_deg", "x_mm", "y_mm")}
        columns = {
            "tip": touches.indenter_radius_mm,
            **{name: values for name, values in places.items() if values is not None},
            "load": touches.load,
            "samples": touches.reads,
            "gain": self.gain[np.arange(len(self.chosen)), self.chosen],
            **{self._column(name): self.after[:, i] for i, name in enumerate(self.quantities)},
        }
        table = pd.DataFrame(columns, index=pd.Index(self.chosen, name="touch"))
        units = {
            "tip": "mm",
            **{name: "degree" if name == "angle_deg" else "mm" for name in places if name in columns},
            "load": self.load_unit,
            # A share of the variance has no unit.
            "gain": "nat" if self.quantities == (LOG_BAYES_FACTOR,) else "",
        }
        of_quantities = zip(self.quantities, self.units, strict=True)
        table.attrs["units"] = units | {self._column(name): unit for name, unit in of_quantities}
        return table

    def summary_lines(self) -> list[str]:
        """Lines that ``repr`` shows."""
        touches = [
            f"{self.in_words(i)}, load {number(float(self.touches.load[i]))} {self.load_unit}".rstrip()
            for i in range(min(len(self.chosen), NAMED))
        ]
        more = [f"and {len(self.chosen) - NAMED} more"] if len(self.chosen) > NAMED else []
        changes = [
            f"{name}: expected {'' if name == LOG_BAYES_FACTOR else 'sd '}{number(before)} → {number(after)} {unit}"
            for name, unit, before, after in zip(self.quantities, self.units, self.before, self.after[-1], strict=True)
        ]
        first = f"NextTouches about {self.about}: {plural(len(self.chosen), 'touch')} of {self.gain.shape[1]}"
        return [first, *touches, *more, *(each.rstrip() for each in changes)]

    def in_words(self, i: int) -> str:
        """Tip and place of the chosen touch with index i, as text."""
        touches, radius = self.touches, float(self.touches.indenter_radius_mm[i])
        tip = "edge" if radius == 0 else "flat" if np.isinf(radius) else f"tip of {number(radius)} mm"
        on_pad = [(name, axis) for name, axis in (("x", touches.x_mm), ("y", touches.y_mm)) if axis is not None]
        place = f"{', '.join(f'{name} = {exact(float(axis[i]))}' for name, axis in on_pad)} mm"
        if touches.angle_deg is not None:
            place = f"{exact(float(touches.angle_deg[i]))}°"
        return place if np.isnan(radius) else f"{tip} at {place}"

    def _column(self, name: str) -> str:
        return name if name == LOG_BAYES_FACTOR else f"{name}_sd"


def next_touches(
    source: Calibration | Diagnosis,
    candidates: Touches | None = None,
    *,
    count: int = 1,
    about: str | tuple[str, str] = "calibration",
    places: Touches | None = None,
    quantities: str | Sequence[str] | None = None,
) -> NextTouches:
    """Choose the touches that are expected to tell most, one after the other.

    Nothing is simulated: to first order the posterior after a touch does not depend on its readings. Each step takes
    the candidate with the largest gain, given those taken before, and updates the covariance.

    Parameters
    ----------
    source : Calibration or Diagnosis
        Calibration of a finger or a pad; of a diagnosis its ``calibration_after``, or its fits if `about` is causes.
    candidates : Touches, optional
        Touches that can be made: place, tip (on a finger), load, and number of samples (rows of a touch, or `reads`).
        Readings are not used. By default those of `candidate_touches`.
    count : int
        Number of touches to choose.
    about : {"calibration", "places", "causes"} or (str, str)
        What the touches are to tell. ``"calibration"``: σ, μ and r_s of a finger; gains, positions and the kernel of a
        pad, and its sensitivity at the places of the calibration if it has an empirical map. ``"places"``: what the
        errors of the calibration do to touches that are read at `places`: to R on a finger, to the location on a pad.
        Two names of causes: which of two causes of a diagnosis is right, such as
        ``("gain_drift", "something in place")``; ``"causes"`` compares the most probable set of causes with the next
        one that differs from it by one cause, both with a probability of at least 1 %.
    places : Touches, optional
        Touches that will be read, for ``about="places"``; by default a grid with the tips and the load of the
        calibration, over the places between the elements.
    quantities : str or sequence of str, optional
        Names of the parameters or coordinates whose standard deviations are to be lowered, such as ``("sigma", "mu")``
        or ``"theta_c"``; by default all parameters above, or R (x and y on a pad).

    Returns
    -------
    NextTouches

    Raises
    ------
    InputError
        `about` is unknown or does not fit `source`, the causes are settled (only one set of those that were tried is
        probable), `places` or `quantities` do not fit `about`, a quantity is unknown, there are no candidates or fewer
        than `count`, a candidate has no place or tip, touches are of another sensor, or the calibration has an
        identified E map.

    Notes
    -----
    For standard deviations the gain is the decrease of the mean over the quantities of their variance (mean over the
    elements or places) divided by that before the first touch. So a quantity counts by ratios, whatever its unit.
    For causes it is the increase of the expected log Bayes factor in favour of the right cause. Both models keep the
    uncertainty of their parameters and learn from each chosen touch: what one cause can imitate by other parameters
    counts for nothing. If a drift is one of the causes, the times of the touches matter: `time_s` of the candidates is
    the time after the end of the data set, 0 where it is not stated.

    Examples
    --------
    >>> import bayestouch
    >>> design = bayestouch.FingerDesign(n_elements=4, calibration_span_deg=20.0, touch_step_deg=10.0)
    >>> dataset = bayestouch.simulate(design, seed=3).dataset
    >>> calibration = bayestouch.calibrate(dataset, draws=200)
    >>> tips = bayestouch.candidate_touches(calibration, tips_mm=[0.0, 3.9, 12.3])
    >>> chosen = bayestouch.next_touches(calibration, tips, count=5, about="places")
    >>> chosen.quantities, chosen.units
    (('R',), ('mm',))
    >>> len(chosen.to_dataframe())
    5
    """
    calibration = source.calibration_after if isinstance(source, Diagnosis) else source
    if not isinstance(calibration, Calibration):
        raise InputError(f"expected a calibration or a diagnosis, got {type(source).__name__}")
    if isinstance(about, str) and about not in ABOUT:
        raise InputError(
            f"about: expected {', '.join(ABOUT)}, or two names of causes, got {shown(about)}{nearest(about, ABOUT)}"
        )
    if not isinstance(about, str):
        named = isinstance(about, tuple | list) and all(isinstance(each, str) for each in about)
        if not named or len(about) != 2:
            raise InputError(f"about: expected two names of causes, got {shown(about)}")
    if places is not None and about != "places":
        raise InputError('places: expected with about="places" only')
    if quantities is not None and about not in ("calibration", "places"):
        raise InputError("quantities: expected with standard deviations only, not with causes")
    quantities = (quantities,) if isinstance(quantities, str) else quantities
    for name, given in (("candidates", candidates), ("places", places)):
        if not (given is None or isinstance(given, Touches)):
            raise InputError(f"{name}: expected Touches, as of candidate_touches, got {type(given).__name__}")
        m = calibration.sensor.n_elements
        if given is not None and given.n_elements != m:
            raise InputError(f"{name}: expected touches of {m} elements, got {given.n_elements}")
    table = candidate_touches(calibration) if candidates is None else candidates
    means = planned_table(table, calibration)
    if not (isinstance(count, int | np.integer) and 1 <= count <= means.n_touches):
        raise InputError(f"count: expected from 1 to the number of candidates, {means.n_touches}, got {shown(count)}")
    names: tuple[str, ...]
    if about in ("calibration", "places"):
        asked, choice = _about_sds(calibration, table, places, quantities, count, str(about))
        names, units, title = tuple(each.name for each in asked), tuple(each.unit for each in asked), str(about)
    else:
        if not isinstance(source, Diagnosis):
            raise InputError("about: causes are compared for a diagnosis; this is a calibration")
        pair = TwoCauses.probable(source) if about == "causes" else TwoCauses.named(source, (about[0], about[1]))
        one, other = pair.models(means)
        choice, names, units, title = most_decisive(one, other, count), (LOG_BAYES_FACTOR,), ("nat",), pair.title
    return NextTouches(
        about=title,
        touches=_rows_of(means, choice.chosen),
        chosen=choice.chosen,
        gain=choice.gain,
        quantities=names,
        units=units,
        load_unit=load_unit(calibration),
        before=choice.value[0],
        after=choice.value[1:],
    )


def _about_sds(
    calibration: Calibration,
    table: Touches,
    places: Touches | None,
    names: Sequence[str] | None,
    count: int,
    about: str,
) -> tuple[tuple[Group, ...], ChosenTouches]:
    """Quantities of a calibration, and the choice that lowers their standard deviations."""
    body = body_of(calibration.sensor)
    if about == "calibration":
        planned = body.planned(calibration, table)
        _check(names, [each.name for each in planned.parameters])
        asked = tuple(each for each in planned.parameters if names is None or each.name in names)
        return asked, lowest_sd(planned.readings, asked, count)
    read = touches_to_read(calibration) if places is None else places
    planned = body.planned(calibration, joined_tables(table, read))
    _check(names, list(planned.coordinates))
    n, t = (planned_table(each, calibration).n_touches for each in (table, read))
    asked = planned.biases(n + np.arange(t), names)
    return asked, lowest_sd(planned.readings.select(np.arange(n)), asked, count)


def _check(names: Sequence[str] | None, known: list[str]) -> None:
    if names is None:
        return
    unknown = [each for each in names if each not in known] if isinstance(names, Iterable) else [names]
    if unknown or not names:
        got = unknown[0] if unknown else names
        question = nearest(str(got), known)
        raise InputError(f"quantities: expected names among {', '.join(known)}, got {shown(got)}{question}")


def _rows_of(means: TouchMeans, chosen: NDArray[np.int64]) -> Touches:
    """Some touches, one row each, without readings."""
    some = means.select(chosen)
    return one_row_each(some, touch=np.arange(len(chosen)), readings=np.full(some.readings.shape, np.nan))
