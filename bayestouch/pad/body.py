"""The `Body` of pads. Its functions import the modules that they need when they are called."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bayestouch.model.body import Body, Option

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from bayestouch.array_types import FloatArray
    from bayestouch.data.averages import TouchMeans
    from bayestouch.data.dataset import DataSet
    from bayestouch.data.sensor import Pad
    from bayestouch.data.touches import Touches
    from bayestouch.effects.stated import StatedModel
    from bayestouch.model.beginning import Beginning
    from bayestouch.model.planned import PlannedTouches
    from bayestouch.model.split_data import SplitData
    from bayestouch.priors.parameters import Prior
    from bayestouch.reading.live import LiveBody
    from bayestouch.reading.options import Options
    from bayestouch.reading.touch_reader import TouchReader
    from bayestouch.results.objects import Calibration

# Largest number of training touches in a search for effects. A fit with an empirical map has hundreds of weights; with
# this number of touches and eight elements it takes one second.
MOST_TOUCHES = 1000


def _setting(pad: Pad, contact: str) -> dict[str, Any]:
    columns = (pad.element_x_mm, pad.element_y_mm)
    return {
        "finger": False,
        "element_place": tuple(np.asarray(axis, dtype=float) for axis in columns if axis is not None),
        "contact": "",
    }


def _calibrate(
    dataset: DataSet, *, kernel: str | None, e_map: str, priors: Mapping[str, Prior] | None, **common: Any
) -> Calibration:
    from bayestouch.pad.calibration import calibrate_pad
    from bayestouch.pad.choice import EMPIRICAL

    return calibrate_pad(dataset, kernel=kernel or "auto", empirical=EMPIRICAL[e_map], stated=priors, **common)


def _begin(data: SplitData, **options: Any) -> Beginning:
    from bayestouch.pad.beginning import begin

    return begin(data, **options)


def _stated(calibration: Calibration) -> tuple[StatedModel, dict[str, Any]]:
    from bayestouch.pad.log_density import stated_pad

    return stated_pad(calibration)


def _reader(calibration: Calibration, options: Options) -> TouchReader:
    from bayestouch.pad.reading.touch_reader import PadTouchReader

    return PadTouchReader.from_calibration(calibration, options)


def _live(calibration: Calibration, options: Options, arrays: Mapping[str, FloatArray] | None) -> LiveBody:
    from bayestouch.pad.reading.live import PadLive

    return PadLive.of(calibration, options, arrays)


def _lacking(dataset: DataSet, known: TouchMeans) -> Iterator[str]:
    from bayestouch.pad.lacking import lacking_to_calibrate

    return lacking_to_calibrate(dataset, known)


def _planned(calibration: Calibration, table: Touches) -> PlannedTouches:
    from bayestouch.pad.planned import planned

    return planned(calibration, table)


def _loads_as_read(calibration: Calibration) -> FloatArray:
    from bayestouch.pad.corrected import PadEffects

    acting, effects = calibration.rows.load, PadEffects.of(calibration)
    return acting if effects is None else effects.as_read(acting)


BODY = Body(
    kind="pad",
    options={
        "groups": Option(()),
        "kernel": Option(),
        "e_map": Option("auto", ("auto", "model", "empirical")),
        "priors": Option(),
    },
    main_option="kernel",
    references=("x_mm", "y_mm"),
    scanned=True,
    needs_load=True,
    setting=_setting,
    calibrate=_calibrate,
    begin=_begin,
    reader=_reader,
    live=_live,
    stated=_stated,
    lacking=_lacking,
    planned=_planned,
    loads_as_read=_loads_as_read,
    most_touches=MOST_TOUCHES,
    instead={
        "contact": "a pad has no contact model, choose a kernel: it describes contact and body together",
        "each_sample": "a pad is read touch by touch with emcee",
        "method": "a pad is read touch by touch with emcee",
        "indenter": "a pad does not measure radii",
    },
)
