"""What a number means in a simulation, what is refused, and effects of other packages, of each kind."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib import import_module
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from bayestouch.array_types import FloatArray
from bayestouch.chain.finger import FingerChain
from bayestouch.chain.recording import Recording
from bayestouch.effects import (
    Effect,
    EffectParameter,
    NoiseEffect,
    RandomEffect,
    Setting,
    Stage,
    Values,
    catalogue,
    effect_classes,
)
from bayestouch.errors import InputError
from bayestouch.priors.parameters import LogNormal, Normal
from bayestouch.simulation import SHAPES, FingerDesign, PadDesign, simulate

# The package has a function of that name too.
CATALOGUE = import_module("bayestouch.effects.catalogue")
SMALL = FingerDesign(
    samples_per_touch=3,
    edge_step_deg=10.0,
    flat_step_deg=30.0,
    touch_radii_mm=(0.0, 6.0),
    touch_step_deg=8.0,
    noise_percent_peak=0.0,
    force_noise_sd=0.0,
)
PAD = PadDesign(noise_percent_peak=0.0, force_noise_sd=0.0, calibration_step_mm=4.0, n_touches=20)


def readings(effects: dict[str, float], design: FingerDesign | PadDesign = SMALL) -> FloatArray:
    dataset = simulate(design, effects=effects, seed=3).dataset
    assert dataset.calibration is not None
    return np.concatenate([dataset.calibration.readings, dataset.touches.readings])


def test_one_number_is_the_first_parameter_and_any_other_goes_by_its_name() -> None:
    np.testing.assert_array_equal(readings({"creep": 0.1}), readings({"creep.share": 0.1, "creep.time": 1.0}))
    assert np.abs(readings({"creep": 0.1, "creep.time": 3.0}) - readings({"creep": 0.1})).max() > 1
    # an effect may be given by another of its amplitudes alone
    truth = simulate(SMALL, effects={"prober_eccentricity.cosine": 2.0}, seed=3).truth
    assert truth["effect_values"] == {"prober_eccentricity.sine": 0.0, "prober_eccentricity.cosine": 2.0}
    assert truth["effects"] == {"prober_eccentricity.cosine": 2.0}


def test_amplitudes_that_are_not_stated_have_the_value_at_which_they_do_nothing() -> None:
    """Any amplitude may be the one that is stated; the level of a saturation does nothing at infinity, not at zero."""
    alone = simulate(SMALL, effects={"prober_eccentricity.cosine": 0.1}, seed=0).truth["effect_values"]
    assert alone == {"prober_eccentricity.sine": 0.0, "prober_eccentricity.cosine": 0.1}
    with pytest.raises(InputError, match=r"^effect saturation: expected a value of level too$"):
        simulate(SMALL, effects={"saturation.knee": 40.0}, seed=0)


def test_the_order_in_which_effects_are_named_does_not_count() -> None:
    one, other = {"memory": 0.2, "crosstalk": 0.05, "creep": 0.1}, {"creep": 0.1, "crosstalk": 0.05, "memory": 0.2}
    np.testing.assert_array_equal(readings(one), readings(other))


def test_shapes_are_those_of_effects_that_there_are() -> None:
    """Each names a parameter that is no amplitude, and a value that the prior allows."""
    for design in (SMALL, PAD):
        rng = np.random.default_rng(0)
        for effect in catalogue(design.build(rng).setting(design.plan(rng))):
            for parameter in effect.parameters:
                if parameter.name in SHAPES.get(effect.name, {}):
                    assert parameter.null is None
                    assert parameter.prior.log_density(SHAPES[effect.name][parameter.name]) > -np.inf
    assert set(SHAPES) <= set(effect_classes())


@pytest.mark.parametrize(
    ("effects", "design", "message"),
    [
        ({"gremlins": 1.0}, SMALL, "unknown effect 'gremlins'; known are prober_ecc.*outliers"),
        ({"outliers": 1.5}, SMALL, "effect outliers: expected a probability from 0 to 0.3, got 1.5"),
        ({"crosstalk": np.nan}, SMALL, r"effect crosstalk: expected a finite share \(plausible: .*\), got nan"),
        ({"crosstalk": np.inf}, SMALL, r"effect crosstalk: expected a finite share \(plausible: .*\), got inf"),
        ({"crosstalk": -1e300}, SMALL, r"effect crosstalk: expected a finite share \(plausible: .*\), got -1e\+300"),
        ({"blunt_edge": -1.0}, SMALL, r"expected a finite radius from 0 up \(plausible: 0.0013 to 3.3\), got -1"),
        ({"saturation": 0.0}, SMALL, r"expected a finite level above 0 \(plausible: 0.21 to 4.7\), got 0"),
        ({"aperture": 1.0}, PAD, "effect aperture cannot occur, or not be seen, in this design"),
        ({"creep": 0.1}, replace(SMALL, samples_per_touch=1), "effect creep cannot occur"),
        ({"creep": 0.1, "creep.share": 0.1}, SMALL, "effect creep: share is given twice"),
        (
            {"creep": 0.1, "creep.tempo": 1.0},
            SMALL,
            "unknown parameter of effect creep: 'tempo'; known are share, time",
        ),
        ({"creep.time": 1.0}, SMALL, "effect creep: expected a value of share too"),
        ({"prober_eccentricity.": 1.0}, SMALL, "unknown parameter of effect prober_eccentricity: ''; known are"),
    ],
)
def test_what_cannot_be_simulated_is_refused_in_a_line(
    effects: dict[str, float], design: FingerDesign | PadDesign, message: str
) -> None:
    with pytest.raises(InputError, match=message):
        simulate(design, effects=effects, seed=0)


def amplitude(name: str = "size") -> tuple[EffectParameter, ...]:
    return (EffectParameter(name, "", "size", Normal(0.0, 1.0), (0.1,), 0.0),)


class Anywhere(Effect):
    """What the effects below have in common."""

    summary: ClassVar[str] = "one of another package"

    @classmethod
    def suited(cls, setting: Setting) -> Effect | None:
        return cls()


@dataclass(frozen=True)
class Late(Anywhere):
    """A prober that has not arrived."""

    parameters: tuple[EffectParameter, ...] = amplitude()
    name: ClassVar[str] = "late"
    stage: ClassVar[Stage] = "rig"

    def pose(self, recording: Recording, values: Values) -> Recording:
        return replace(recording, place=(recording.place[0] - values[0],))


@dataclass(frozen=True)
class Halved(Anywhere):
    """An element with another amplifier, and rubber that is stiffer."""

    parameters: tuple[EffectParameter, ...] = amplitude()
    name: ClassVar[str] = "halved"
    stage: ClassVar[Stage] = "body"

    def finger(self, chain: FingerChain, values: Values) -> FingerChain:
        factor = np.ones(chain.n_elements)
        factor[3] = 1 - values[0]
        return chain.with_(response=factor * chain.response, shear_modulus_MPa=2 * chain.shear_modulus_MPa)


@dataclass(frozen=True)
class Rectified(Anywhere):
    """No reading is below zero."""

    parameters: tuple[EffectParameter, ...] = amplitude()
    name: ClassVar[str] = "rectified"
    stage: ClassVar[Stage] = "readout"

    def signal(self, recording: Recording, values: Values) -> FloatArray:
        return np.asarray((1 - values[0]) * recording.signal + values[0] * np.abs(recording.signal))


@dataclass(frozen=True)
class Tilting(RandomEffect, Anywhere):
    """A smooth function of time that all elements share, in counts."""

    parameters: tuple[EffectParameter, ...] = (
        *amplitude("sd"),
        EffectParameter("time", "s", "time", LogNormal(300.0, 1.0), (100.0, 300.0, 900.0)),
    )
    name: ClassVar[str] = "tilting"
    stage: ClassVar[Stage] = "readout"

    def own(self, values: Values) -> bool:
        return False

    def scale(self, recording: Recording) -> FloatArray:
        return np.full(recording.signal.shape, 100.0)


@dataclass(frozen=True)
class Popcorn(NoiseEffect, Anywhere):
    """Readings jump by one peak, one way or the other."""

    parameters: tuple[EffectParameter, ...] = amplitude("share")
    name: ClassVar[str] = "popcorn"
    stage: ClassVar[Stage] = "noise"

    def errors(self, recording: Recording, values: Values, rng: np.random.Generator) -> FloatArray:
        jump = rng.choice([-1.0, 0.0, 1.0], recording.signal.shape, p=[values[0] / 2, 1 - values[0], values[0] / 2])
        return np.asarray(jump * recording.peak)


@dataclass(frozen=True)
class Silent(NoiseEffect, Anywhere):
    """One that does not say how it is drawn."""

    parameters: tuple[EffectParameter, ...] = amplitude()
    name: ClassVar[str] = "silent"
    stage: ClassVar[Stage] = "noise"


@pytest.fixture
def installed(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A package with these effects."""

    def point(cls: type[Effect]) -> Any:
        return SimpleNamespace(name=cls.name, value=f"others:{cls.__name__}", load=lambda: cls)

    points = [point(cls) for cls in (Late, Halved, Rectified, Tilting, Popcorn, Silent)]
    monkeypatch.setattr(CATALOGUE, "entry_points", lambda group: points)
    yield


@pytest.mark.usefixtures("installed")
def test_effects_of_other_packages_of_each_kind_are_simulated() -> None:
    plain, truth = readings({}), simulate(SMALL, seed=3).truth
    late = simulate(SMALL, effects={"late": 2.0}, seed=3)
    np.testing.assert_allclose(late.truth["touches"]["theta_c"], np.subtract(truth["touches"]["theta_c"], 2.0))
    assert np.abs(readings({"late": 2.0}) - plain).max() > 10

    # Twice the modulus is half the strain of a sharp edge; the gains stay but for that of one element.
    edges = simulate(SMALL, effects={"halved": 0.5}, seed=3).dataset.calibration
    assert edges is not None
    sharp = edges.indenter_radius_mm == 0
    ratio = edges.readings[sharp] / plain[: len(sharp)][sharp]
    np.testing.assert_allclose(ratio, np.broadcast_to(np.where(np.arange(16) == 3, 0.25, 0.5), ratio.shape))

    np.testing.assert_allclose(readings({"rectified": 1.0}), np.abs(plain))

    course = (readings({"tilting": 0.5, "tilting.time": 200.0}) - plain) / 100
    np.testing.assert_allclose(course, course[:, :1] * np.ones(16), atol=1e-9)
    assert 0.05 < course.std() < 1.5  # one path of some correlation times
    assert np.abs(np.diff(course[:, 0])).max() < 0.3 * np.ptp(course)  # and smooth

    jump = (readings({"popcorn": 0.1}) - plain) / (200 * np.array(truth["response"]))
    np.testing.assert_allclose(jump, np.round(jump), atol=1e-9)
    assert abs((np.round(jump) != 0).mean() - 0.1) < 4 * np.sqrt(0.09 / jump.size)

    with pytest.raises(InputError, match="effect silent cannot be simulated: it has no method `errors`"):
        readings({"silent": 1.0})


@pytest.mark.usefixtures("installed")
def test_an_effect_draws_the_same_whatever_else_is_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    among = readings({"outliers": 0.05, "baseline_drift": 0.02})
    monkeypatch.setattr(CATALOGUE, "entry_points", lambda group: [])
    np.testing.assert_array_equal(readings({"outliers": 0.05, "baseline_drift": 0.02}), among)
