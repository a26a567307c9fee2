"""Every effect that is installed: null values change nothing, and the page of the catalogue is up to date."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from study_modules import study

from bayestouch.chain.recording import Recording
from bayestouch.chain.response import modes_needed
from bayestouch.commands.cli import main
from bayestouch.effects import Effect, NoiseEffect, RandomEffect, effect_classes
from bayestouch.effects.listing import effect_facts, listing, typical
from bayestouch.effects.noise import CommonModeNoise, Scatter
from bayestouch.errors import InputError
from bayestouch.finger.model import FingerModel
from bayestouch.finger.start import base_fit
from bayestouch.model.split_data import SplitData
from bayestouch.simulation import FingerDesign, simulate

DOCS = Path(__file__).parents[2] / "docs"


@cache
def fitted(contact: str):
    """A finger under few touches, fitted without effects, and what effects may suit themselves to."""
    design = FingerDesign(
        samples_per_touch=2, edge_step_deg=9.0, flat_step_deg=18.0, touch_radii_mm=(0.0, 6.0), touch_step_deg=10.0
    )
    data = SplitData.of(simulate(design, seed=1).dataset)
    fit = base_fit(data.observations(data.training), data.dataset.sensor, contact)
    return fit, data.setting(contact, fit.model.reference_load)


def plain_effects() -> list[str]:
    kinds = (RandomEffect, NoiseEffect)
    return [name for name, cls in effect_classes().items() if not issubclass(cls, kinds)]


def suited(name: str) -> tuple[object, Effect] | None:
    for contact in ("layer", "hertz"):
        fit, setting = fitted(contact)
        effect = effect_classes()[name].suited(setting)
        if effect is not None:
            return fit, effect
    return None


@pytest.mark.parametrize("name", plain_effects())
def test_null_leaves_readings_alone_and_probes_do_not(name: str) -> None:
    found = suited(name)
    if found is None:
        pytest.skip(f"{name} is no effect of a finger touched like this")
    fit, effect = found
    # With the chain for both: an effect before the readings uses it, and the quick evaluator is 1e-5 of the peak off.
    plain_model = replace(fit.model, evaluator=None)
    base = plain_model.predict(fit.vector).touches
    model = plain_model.with_effects((effect,))
    probe = effect.probes[0]

    def readings(values: tuple[float, ...]) -> np.ndarray:
        predicted = model.predict(model.extended(fit.vector, values))
        return predicted.touches if predicted.samples is None else predicted.samples + base[model.known.row_touch]

    plain = base if readings(probe).shape == base.shape else base[model.known.row_touch]
    # Rounding alone, of readings up to the peak.
    np.testing.assert_allclose(readings(effect.without(probe)), plain, atol=1e-9 * float(fit.model.peak.max()))
    assert np.abs(readings(probe) - plain).max() > 1e-6 * fit.model.peak.max()


@pytest.mark.parametrize("name", plain_effects())
def test_derivatives_are_those_of_finite_differences(name: str) -> None:
    """Of the prediction, over an element's angle and each value of the effect, by steps of another size."""
    found = suited(name)
    if found is None:
        pytest.skip(f"{name} is no effect of a finger touched like this")
    fit, effect = found
    model = fit.model.with_effects((effect,))
    values = effect.probes[len(effect.probes) // 2]
    vector = model.extended(fit.vector, values)
    touches, _ = model.derivatives(vector)
    spread = np.concatenate([np.full(model.n_base, 1e-4), [0.003 * max(abs(v), 0.1) for v in vector[model.n_base :]]])
    for i in (model.layout.angle.start + 7, *range(model.n_base, len(vector))):
        up, down = vector.copy(), vector.copy()
        up[i] += spread[i]
        down[i] -= spread[i]
        slope = (model.predict(up).touches - model.predict(down).touches) / (2 * spread[i])
        size = np.abs(slope).max()
        # Central differences of both kinds are wrong by the cube of their steps, 1 % of the width of each effect.
        np.testing.assert_allclose(touches[i], slope, atol=0.02 * size + 1e-9 * float(fit.model.peak.max()))


@pytest.mark.parametrize("name", [n for n, c in effect_classes().items() if issubclass(c, NoiseEffect)])
def test_null_of_noise_is_normal_noise(name: str) -> None:
    effect = typical(effect_classes()[name])
    assert isinstance(effect, NoiseEffect)
    rng = np.random.default_rng(0)
    z, signal = rng.standard_normal((40, 5)), rng.uniform(0, 1, (40, 5))
    null = effect.without(effect.probes[0])
    density = effect.log_density(Scatter(z, signal, np.full(5, 0.02), np.ones(5)), null)
    normal = -0.5 * (z**2).sum(axis=1)
    np.testing.assert_allclose(density - density[0], normal - normal[0], atol=1e-6)


@pytest.mark.parametrize("name", [n for n, c in effect_classes().items() if issubclass(c, RandomEffect)])
def test_random_functions_have_the_stated_size(name: str) -> None:
    """At knots the process has exactly its sd; between them a little less."""
    effect = typical(effect_classes()[name])
    assert isinstance(effect, RandomEffect)
    basis = effect.basis(np.linspace(0, 3600, 50), (0.02, 300.0), 0.0, 3600.0)
    sd = np.sqrt((basis**2).sum(axis=1))
    assert sd.min() > 0.95 * 0.02 and sd.max() < 1.001 * 0.02
    blank = Recording(
        *(np.zeros(2), (np.zeros(2),), np.ones(2), np.zeros(2), np.zeros(2), (np.zeros(3),)),
        peak=np.ones(3),
        reference_load=1.0,
        signal=np.full((2, 3), 0.5),
    )
    assert effect.scale(blank).shape == (2, 3)


def test_every_effect_says_what_it_is() -> None:
    for row in listing():
        facts = effect_facts(row["name"])
        assert row["summary"] and "Reference" in facts["physics"], row["name"]
        assert facts["parameters"], row["name"]
        assert any(each["null"] is not None for each in facts["parameters"]), row["name"]
    with pytest.raises(InputError, match="unknown effect 'magic'"):
        effect_facts("magic")


def test_the_page_of_the_catalogue_is_up_to_date() -> None:
    """If this fails, run studies/effects_gallery.py."""
    assert (DOCS / "effects.md").read_text("utf-8") == study("_effects_page").page()
    for name in effect_classes():
        assert (DOCS / "effects" / f"{name}.png").is_file()


def test_the_command_lists_them(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects"]) == 0
    assert "crosstalk" in capsys.readouterr().out
    assert main(["effects", "aperture"]) == 0
    assert "width in mm" in capsys.readouterr().out
    assert main(["effects", "magic"]) == 2


@pytest.mark.parametrize("shared", [0.0, 1.0])
def test_own_noise_is_found_under_a_larger_shared_error(shared: float) -> None:
    """Where the shared error is five times the noise, the noise is no difference of two large variances."""
    rng = np.random.default_rng(3)
    peak, n, own_sd, size = np.array([0.6, 0.9, 1.0, 1.1, 1.4]), 4000, 0.014, 0.07
    noise = own_sd * rng.standard_normal((n, 5)) + size * peak ** (1 - shared) * rng.standard_normal((n, 1))
    total = noise.std(axis=0)
    effect = CommonModeNoise()
    scatter = Scatter(noise / total, noise, total / peak, peak)
    own = effect.own(scatter, (size, shared)) * total**2
    # A variance of n readings scatters by sqrt(2/n), 2 %; what the other elements say of the shared part adds a half.
    np.testing.assert_allclose(own / own_sd**2, 1, atol=0.12)

    def log_density(kind: float) -> float:
        return float(effect.log_density(scatter, (size, kind)).sum())

    assert log_density(shared) > log_density(1 - shared) + 100


def test_no_fit_takes_a_contact_beyond_its_table() -> None:
    """Nowhere between the bounds, at any Poisson's ratio: a step of a fit may try any corner."""
    found = suited("crosstalk")
    assert found is not None
    model, vector = found[0].model, found[0].vector.copy()  # type: ignore[attr-defined]
    _, _, low, high = model.prior()
    vector[model.layout.log_mu] = low[model.layout.log_mu]
    for sigma in np.linspace(low[model.layout.sigma], high[model.layout.sigma], 5):
        vector[model.layout.sigma] = sigma
        assert np.isfinite(model.predict(vector).touches).all()


def test_no_fit_takes_an_element_to_the_very_surface() -> None:
    """There a table has as many waves as fill the memory; the prior's own bound is a thousandth of the rubber."""
    found = suited("crosstalk")
    assert found is not None
    model = found[0].model  # type: ignore[attr-defined]
    assert isinstance(model, FingerModel)
    highest = model.prior()[3][model.layout.depth]
    assert np.all(highest > model.finger.sensing_radius_mm)
    # With four angles a wave, a table of 16 elements then takes 200 MB.
    assert modes_needed(float(highest.max()), model.finger.outer_radius_mm) < 2048
