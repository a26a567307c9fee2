"""The `Body` of fingers. Modules are imported when they are used."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bayestouch.data.finger import Finger
from bayestouch.model.body import Body, Option

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from bayestouch.array_types import FloatArray
    from bayestouch.data.averages import TouchMeans
    from bayestouch.data.dataset import DataSet
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


def _setting(finger: Finger, contact: str) -> dict[str, Any]:
    return {
        "finger": True,
        "element_place": (np.asarray(finger.element_angles_deg, dtype=float),),
        "contact": contact,
        "radii_mm": (finger.core_radius_mm, finger.outer_radius_mm),
    }


def _calibrate(
    dataset: DataSet,
    *,
    contact: str,
    e_map: str,
    discrepancy: str,
    priors: Mapping[str, Prior] | None,
    **common: Any,
) -> Calibration:
    from bayestouch.finger.calibration import calibrate_finger

    return calibrate_finger(dataset, contact=contact, e_map=e_map, discrepancy=discrepancy, stated=priors, **common)


def _learned_priors(
    earlier: Sequence[tuple[str, Calibration]], dataset: DataSet, contact: str
) -> tuple[dict[str, Prior], tuple[str, ...]]:
    from bayestouch.finger.learned_priors import learned_priors
    from bayestouch.finger.same_build import check_other_touches

    assert dataset.calibration is not None
    check_other_touches(earlier, dataset.calibration)
    counts = dataset.calibration.averaged().counts
    return learned_priors(earlier, dataset.sensor, contact, float(np.median(counts[counts > 0])))


def _begin(data: SplitData, **options: Any) -> Beginning:
    from bayestouch.finger.beginning import begin

    return begin(data, **options)


def _stated(calibration: Calibration) -> tuple[StatedModel, dict[str, Any]]:
    from bayestouch.finger.stated import stated_of

    return stated_of(calibration)


def _reader(calibration: Calibration, options: Options) -> TouchReader:
    from bayestouch.finger.reading.touch_reader import FingerTouchReader

    return FingerTouchReader.from_calibration(calibration, options)


def _live(calibration: Calibration, options: Options, arrays: Mapping[str, FloatArray] | None) -> LiveBody:
    from bayestouch.finger.reading.live import FingerLive

    return FingerLive.of(calibration, options, arrays)


def _lacking(dataset: DataSet, known: TouchMeans) -> Iterator[str]:
    from bayestouch.finger.lacking import lacking_to_calibrate

    return lacking_to_calibrate(dataset, known)


def _planned(calibration: Calibration, table: Touches) -> PlannedTouches:
    from bayestouch.finger.planned import planned

    return planned(calibration, table)


def _loads_as_read(calibration: Calibration) -> FloatArray:
    return calibration.rows.load


BODY = Body(
    kind="finger",
    options={
        "contact": Option(Finger.default_contact),
        "e_map": Option("model", ("model", "empirical")),
        "discrepancy": Option("auto", ("auto", "none", "touch", "place")),
        "priors": Option(),
        "like": Option(()),
        "groups": Option(()),
        "moves": Option(),
        "each_sample": Option(False),
        "method": Option("emcee"),
        "indenter": Option(),
    },
    main_option="contact model",
    references=("indenter_radius_mm", "angle_deg"),
    scanned=False,
    setting=_setting,
    calibrate=_calibrate,
    begin=_begin,
    reader=_reader,
    live=_live,
    stated=_stated,
    lacking=_lacking,
    planned=_planned,
    loads_as_read=_loads_as_read,
    learned_priors=_learned_priors,
)
