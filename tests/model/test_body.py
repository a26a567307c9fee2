"""The seam between the verbs and the bodies: what each body's options are, and that a further body is one line."""

from __future__ import annotations

import sys
from dataclasses import replace
from types import ModuleType
from typing import Any

import pytest

from bayestouch.data.geometry import BODIES
from bayestouch.data.sensor import Finger, Pad
from bayestouch.errors import InputError
from bayestouch.model.body import Option, body_of_kind

CALIBRATE = {"contact": None, "e_map": None, "priors": None, "kernel": None}
INFER = {"each_sample": None, "method": None, "indenter": None}
NO_CONTACT = (
    "contact is an option of fingers; "
    "a pad has no contact model, choose a kernel: it describes contact and body together"
)


@pytest.mark.parametrize(
    ("kind", "verb", "given", "said"),
    [
        (
            "finger",
            CALIBRATE,
            {"kernel": "gaussian"},
            "kernel is an option of pads; this sensor is a finger (its option is the contact model)",
        ),
        ("finger", CALIBRATE, {"e_map": "other"}, "e_map: expected model or empirical, got 'other'"),
        ("finger", CALIBRATE, {"e_map": "auto"}, "e_map: expected model or empirical, got 'auto'"),
        ("pad", CALIBRATE, {"contact": "layer"}, NO_CONTACT),
        ("pad", CALIBRATE, {"e_map": "other"}, "e_map: expected auto or model or empirical, got 'other'"),
        (
            "pad",
            {"contact": None, "kernel": None},
            {"contact": "hertz"},
            NO_CONTACT,
        ),
        (
            "pad",
            INFER,
            {"method": "importance"},
            "method is an option of fingers; a pad is read touch by touch with emcee",
        ),
        (
            "pad",
            INFER,
            {"each_sample": True},
            "each_sample is an option of fingers; a pad is read touch by touch with emcee",
        ),
        (
            "pad",
            INFER,
            {"each_sample": True, "method": "importance"},
            "each_sample and method are options of fingers; a pad is read touch by touch with emcee",
        ),
        ("pad", INFER, {"indenter": "edge"}, "indenter is an option of fingers; a pad does not measure radii"),
    ],
)
def test_options_of_another_body_are_refused(kind: str, verb: dict[str, Any], given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as error:
        body_of_kind(kind).own({**verb, **given})
    assert str(error.value) == said


def test_options_that_are_not_given_take_the_default_of_the_body() -> None:
    finger, pad = body_of_kind("finger"), body_of_kind("pad")
    assert finger.own(CALIBRATE) == {"contact": "layer", "e_map": "model", "priors": None}
    assert finger.own({**CALIBRATE, "contact": "hertz"})["contact"] == "hertz"
    assert pad.own(CALIBRATE) == {"kernel": None, "e_map": "auto", "priors": None} and pad.own(INFER) == {}
    assert pad.own({**CALIBRATE, "kernel": "gaussian", "e_map": "model"}) == {
        "kernel": "gaussian",
        "e_map": "model",
        "priors": None,
    }


def test_every_kind_of_sensor_has_a_body() -> None:
    assert {body_of_kind(kind).kind for kind in BODIES} == {Finger.kind, Pad.kind} == set(BODIES)


def test_a_third_body_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its options are refused elsewhere, and those of others on it, without a word of it anywhere else."""
    skin = replace(
        body_of_kind("pad"), kind="skin", options={"weave": Option("plain")}, main_option="weave", instead={}
    )
    module = ModuleType("skin.body")
    module.BODY = skin  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "skin.body", module)
    monkeypatch.setitem(BODIES, "skin", "skin")
    body_of_kind.cache_clear()
    try:
        assert body_of_kind("skin").own({"weave": None, "contact": None}) == {"weave": "plain"}
        with pytest.raises(InputError, match=r"^contact is an option of fingers; this sensor is a skin "):
            skin.own({"weave": None, "contact": "layer"})
        with pytest.raises(InputError, match=r"^weave is an option of skins; this sensor is a finger "):
            body_of_kind("finger").own({"weave": "twill", "contact": None})
    finally:
        body_of_kind.cache_clear()
