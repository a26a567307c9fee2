"""Priors and starting values of the calibration of a pad, from nominal positions and the locations of peak readings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from bayestouch.array_types import FloatArray
from bayestouch.chain.kernel_choice import kernel_for, kernel_names
from bayestouch.chain.kernels import Kernel, KernelWithPriors
from bayestouch.chain.pad import COORDINATES, PadChain
from bayestouch.data.averages import TouchMeans
from bayestouch.data.sensor import Sensor, pad_of
from bayestouch.errors import InputError, nearest
from bayestouch.model.usable_touches import without_load
from bayestouch.output.text import plural
from bayestouch.pad.reached import Reached
from bayestouch.pad.shift import shift_of_elements
from bayestouch.priors.parameters import LogNormal, Normal, Parameter, Prior, Uniform, moved, truncated
from bayestouch.priors.stated import check_holds
from bayestouch.results.keys import STATED_PRIORS
from bayestouch.results.objects import Calibration

# Prior sd of a position: moulded elements differ from the drawing by a few millimetres.
_POSITION_SD_MM = 3.0

# The prior of a gain is wide: it is normal about zero, and its sd is this multiple of the apparent signal per load.
_GAIN_FACTOR = 10.0

# Possible range of parameters of kernels; that of the others is above zero. At a depth near zero the stress under the
# contact has no limit, and at a Poisson's ratio of 0.5 a bonded layer does not deform.
_POSSIBLE = {"sigma": (0.0, 0.4999), "depth_share": (0.1, 1.0)}

# Locations are on one line if they differ across it by less than this share of what they differ by along it: far above
# rounding, far below what a stage repeats.
_ON_A_LINE = 1e-9


@dataclass(frozen=True, eq=False)
class PadPriors:
    """Centres and widths of the priors of a pad; m elements, D coordinates.

    Attributes
    ----------
    amplitude : (m,) array
        Apparent signal of each element per unit load; determines the widths of priors.
    offset, offset_sd : (m,) arrays
        Mean and sd of the prior of the reading without touch.
    position : (m, D) array
        Nominal positions in the coordinates of the stage, mm: means of the priors.
    position_sd : float
        Standard deviation of the prior of a position, mm.
    moved : str
        One sentence on the shift of the nominal positions, the centres of the priors; empty if it is below 0.05 mm.
    stated : mapping of str to Prior
        Priors stated by the user, by name of the parameter: parameters of kernels, ``gain`` and ``offset`` (value of
        each element), ``x_s`` and ``y_s`` (difference from `position`, mm).
    """

    amplitude: FloatArray
    offset: FloatArray
    offset_sd: FloatArray
    position: FloatArray
    position_sd: float
    moved: str
    stated: Mapping[str, Prior] = field(default_factory=dict)

    def with_stated(self, stated: Mapping[str, Prior], kernel: str, sensor: Sensor) -> PadPriors:
        """The priors with those stated by the user, by name of the parameter.

        With the kernel ``"auto"``, the parameters of all kernels have a name.

        Raises
        ------
        InputError
            If a name is unknown, or a prior contradicts the possible range or the nominal geometry.
        """
        own = _names(kernel, sensor, self.position.shape[1])
        changes: dict[str, Prior] = {}
        for name, prior in stated.items():
            if name not in own:
                of = "a pad" if kernel == "auto" else f"a pad with the {kernel} kernel"
                raise InputError(
                    f"prior of {name}: not a parameter of {of}{nearest(name, own)}; expected one of {', '.join(own)}"
                )
            try:
                changes[name] = _possible(name, prior, sensor)
            except InputError as error:
                raise InputError(f"prior of {name}: {error}") from None
        return replace(self, stated=changes)

    def kernel(self, kernel: Kernel) -> Kernel:
        """The kernel with the stated priors of its parameters."""
        names = {parameter.name for parameter in kernel.parameters}
        return KernelWithPriors(kernel, self.stated) if names & self.stated.keys() else kernel

    def start(self, kernel: Kernel, values: tuple[float, ...]) -> PadChain:
        """Starting values of a fit, with `values` of the kernel."""
        gain = self.amplitude if kernel.parameters else 0.3 * self.amplitude
        return PadChain(kernel, np.array(values), gain.copy(), self.offset.copy(), self.position.copy())

    def of(self, kernel: Kernel) -> tuple[Prior, ...]:
        """Prior of each entry of `PadChain.flat`."""
        stated = self.stated
        gain = [stated.get("gain") or Normal(0.0, _GAIN_FACTOR * scale) for scale in self.amplitude]
        offset = [
            stated.get("offset") or Normal(mean, sd) for mean, sd in zip(self.offset, self.offset_sd, strict=True)
        ]
        position = [
            moved(stated[f"{axis}_s"], 1.0, float(value)) if f"{axis}_s" in stated else Normal(value, self.position_sd)
            for axis, column in zip(COORDINATES, self.position.T, strict=False)
            for value in column
        ]
        return (*gain, *offset, *position, *(parameter.prior for parameter in kernel.parameters))

    def parameters(self, kernel: Kernel, reading_unit: str, load_unit: str) -> tuple[Parameter, ...]:
        """The parameters with their descriptions, for tables and files."""
        per_load = f"{reading_unit}/{load_unit}" if load_unit else reading_unit
        typical = float(np.median(self.amplitude))
        stated = self.stated
        gain, offset = "reading per unit load right above the element", "reading without touch"
        shared = [
            Parameter(
                "gain",
                "G",
                "G",
                per_load,
                stated.get("gain") or Normal(0.0, _GAIN_FACTOR * typical),
                gain if "gain" in stated else f"{gain} (the prior scales with each one's signal)",
                relative="gain" not in stated,
            ),
            Parameter(
                "offset",
                "o",
                "o",
                reading_unit,
                stated.get("offset") or Normal(float(np.median(self.offset)), float(np.median(self.offset_sd))),
                offset if "offset" in stated else f"{offset} (the prior is centred on each element's own)",
                relative="offset" not in stated,
            ),
        ]
        places = (
            Parameter(
                name,
                name,
                name,
                "mm",
                stated.get(name) or Normal(0.0, self.position_sd),
                "position of the element (the prior is of its difference from the nominal place)",
                relative=True,
            )
            for name in (f"{axis}_s" for axis in COORDINATES[: self.position.shape[1]])
        )
        return (*kernel.parameters, *shared, *places)


def used_priors(stated: Mapping[str, Prior], chain: PadChain) -> tuple[dict[str, Prior], tuple[str, ...]]:
    """Stated priors of the parameters that a pad has, and a note on the others, which its kernel does not have."""
    own = {name.partition("[")[0] for name in chain.layout}
    others = [name for name in stated if name not in own]
    note = f"prior of {' and '.join(others)}: not used, because the {chain.kernel.name} kernel is chosen"
    return {name: stated[name] for name in stated if name in own}, (note,) if others else ()


def stated_priors(calibration: Calibration) -> dict[str, Prior]:
    """Priors that were stated for a calibration, by name of the parameter."""
    names = str(calibration.settings.get(STATED_PRIORS, "")).split(", ")
    return {each.name: each.prior for each in calibration.parameters if each.name in names}


def _of_elements(dimensions: int) -> tuple[str, ...]:
    """Names of the parameters that each element has."""
    return ("gain", "offset", *(f"{axis}_s" for axis in COORDINATES[:dimensions]))


def _names(kernel: str, sensor: Sensor, dimensions: int) -> tuple[str, ...]:
    """Parameters whose priors a user may state, for a kernel, or for all with ``"auto"``."""
    kernels = kernel_names(dimensions) if kernel == "auto" else (kernel,)
    # The names do not depend on the pitch.
    of_kernels = (each.name for name in kernels for each in kernel_for(name, sensor, 1.0).parameters)
    return (*dict.fromkeys(of_kernels), *_of_elements(dimensions))


def _possible(name: str, prior: Prior, sensor: Sensor) -> Prior:
    """The prior truncated to the possible range; raises `InputError` if it contradicts the nominal geometry."""
    if not isinstance(prior, Normal | Uniform | LogNormal):
        raise InputError(f"expected a normal, uniform or log-normal prior on a pad, got {prior}")
    if name in ("gain", "offset"):
        return prior
    if name in ("x_s", "y_s"):
        moved(prior, 1.0, 0.0)
        return check_holds(prior, 0.0, "the nominal places (it is the prior of the difference from them, in mm)")
    inside = truncated(prior, *_POSSIBLE.get(name, (0.0, np.inf)))
    thickness = pad_of(sensor).thickness_mm
    if name == "h" and thickness is not None:
        check_holds(inside, thickness, f"the thickness as built, {thickness:g} mm")
    return inside


def pad_priors(
    sensor: Sensor, known: TouchMeans, *, rest_subtracted: bool, usable: NDArray[np.bool_]
) -> tuple[PadPriors, tuple[str, ...]]:
    """Priors of a pad, and their assumptions, one sentence each.

    The origin of the stage is unknown: all elements are shifted together (`bayestouch.pad.shift`), from the median
    difference between the location of the highest readings of an element and its nominal position. The signal of an
    element is the 99.5 % quantile of the deviations of its readings from their median; if loads vary, it is the
    standard deviation of the readings. Elements that no touch is near to have the signal of the others
    (`bayestouch.pad.reached`).

    Raises
    ------
    InputError
        No element responds to the touches.
    """
    nominal = np.stack([np.array(column) for column in pad_of(sensor).places_mm.values()], axis=1)
    typical = float(np.median(known.load))
    # Half of `data.loads.LOADS_VARY`: the largest readings follow the load before it counts as one that varies, and
    # with that limit the priors of pads whose loads differ by 10 to 20 % would be others.
    loads_vary = float(np.ptp(known.load)) > 0.1 * typical
    amplitude, offset = np.full(len(nominal), np.nan), np.zeros(len(nominal))
    for e in np.flatnonzero(usable):
        column = known.readings[:, e]
        here = np.isfinite(column)
        middle = float(np.median(column[here]))
        deviation = np.abs(column[here] - middle)
        size = float(np.std(column[here]) if loads_vary else np.quantile(deviation, 0.995))
        # Above zero, in whatever unit: a reading in farad is far below one.
        amplitude[e] = max(size, 1e-12 * float(np.abs(column[here]).max())) / typical
        offset[e] = 0.0 if rest_subtracted else middle
    if not usable.any():
        raise InputError("no element responds: every one's readings are missing or all the same")
    amplitude = np.where(usable, amplitude, np.nanmedian(amplitude))
    peaks, shift = shift_of_elements(known, nominal, usable, rest_subtracted=rest_subtracted)
    reached = Reached.of(nominal + shift, known.location)
    amplitude = reached.sizes(amplitude, usable)
    off = np.sqrt(((peaks - shift) ** 2).sum(axis=1))
    named = " and ".join(f"{value:+z.1f} mm in {axis}" for value, axis in zip(shift, COORDINATES, strict=False))
    placed = [f"{axis}_s" for axis in COORDINATES[: len(shift)]]
    notes = [note] if (note := reached.note(usable)) else []
    far = usable & reached.pressed & (off > 3 * _POSITION_SD_MM)
    if far.any():
        names = ", ".join(f"e{e + 1:02d}" for e in np.flatnonzero(far))
        notes.append(f"readings of {names} peak more than {3 * _POSITION_SD_MM:g} mm from the element's place")
    return (
        PadPriors(
            amplitude=amplitude,
            offset=offset,
            offset_sd=(1.0 if rest_subtracted else 3.0) * amplitude * typical,
            position=nominal + shift,
            position_sd=_POSITION_SD_MM,
            moved=f"priors of the elements' places are centred {named} from the stated places, by where readings are "
            f"large: the stage's origin is not known. The places found are {' and '.join(placed)}"
            if np.abs(shift).max() >= 0.05
            else "",
        ),
        tuple(notes),
    )


def check_places(known: TouchMeans, kernel: str, without: int = 0) -> None:
    """Raise InputError unless there are touches at enough locations for the parameters of an element.

    `without` touches were left out because they have no load.
    """
    own = _own_parameters(known, kernel)
    places = len(np.unique(known.location, axis=0))
    if places < own + 1:
        left_out = f" ({without_load(without)})" if without else ""
        raise InputError(
            f"calibration has touches at {plural(places, 'known location')}{left_out}: "
            f"{'gain and offset' if kernel == 'constant' else 'gain, offset and position'} of each element need at "
            f"least {own + 1}; touch the pad in more places"
        )


def _own_parameters(known: TouchMeans, kernel: str) -> int:
    """Number of parameters of each element: gain, offset and position, which the constant kernel does not have."""
    return 2 + (0 if kernel == "constant" else known.location.shape[1])


def check_identifiable(known: TouchMeans, kernel: Kernel, usable: NDArray[np.bool_]) -> None:
    """Raise InputError unless there are enough touches, not all on one line, for the parameters of every element.

    Each element has its own gain, offset and position; the kernel is shared by all elements.
    """
    check_places(known, kernel.name)
    own = _own_parameters(known, kernel.name)
    across = np.linalg.svd(known.location - known.location.mean(axis=0), compute_uv=False)
    if across[-1] <= _ON_A_LINE * across[0]:
        raise InputError("all calibration touches are on one line: touch the pad beside it too, or drop a coordinate")
    for e in np.flatnonzero(usable):
        count = int(np.isfinite(known.readings[:, e]).sum())
        if count < own + 1:
            raise InputError(
                f"{count} calibration touches have a reading: its gain, offset and position need at least {own + 1}",
                column=f"e{e + 1:02d}",
            )
    total = int(np.isfinite(known.readings[:, usable]).sum())
    unknowns = own * int(usable.sum()) + len(kernel.parameters)
    if total <= unknowns:
        raise InputError(
            f"calibration has {total} readings for {unknowns} unknowns of the {kernel.name} kernel: touch the pad in "
            "more places"
        )


def prior_precision(prior: Prior, value: float) -> float:
    """Prior precision at a value; a flat prior counts as a normal one, its width as the sd (as in fits)."""
    if isinstance(prior, Normal):
        return float(prior.sd**-2.0)
    if isinstance(prior, LogNormal):
        return float((value * prior.spread) ** -2.0)
    low, high = prior.support
    return float((high - low) ** -2.0)
