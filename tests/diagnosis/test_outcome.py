"""Sentences of an outcome, written out, and what counts as worse at its limits."""

from __future__ import annotations

from typing import Any

import pytest

from bayestouch.diagnosis import outcome
from bayestouch.diagnosis.outcome import (
    VERDICTS,
    sentences,
    verdict_sentence,
    verdict_word,
    worse_lines,
    worse_quantities,
)

BEFORE = {"prediction_error_percent_peak": 1.0, "lack_of_fit": 2.0, "R_bias_mm": -0.1, "coverage_90": 0.8}
AFTER = {"prediction_error_percent_peak": 0.5, "lack_of_fit": 1.02, "R_bias_mm": 0.02, "coverage_90": 0.9}
LIMITS = {"low": 0.9, "high": 1.1, "expected": 1.0}


def numbers(word: str = "explained", **changes: Any) -> dict[str, Any]:
    made: dict[str, Any] = {
        "data": {"held_out_touches": 100},
        "noise_floor_percent_peak": 0.45,
        "noise_from_repeats": True,
        "loads_measured": True,
        "before": BEFORE,
        "after": AFTER,
        "after_against_stated": AFTER,
        "change_against_stated_se": dict.fromkeys(AFTER, 0.01),
        "lack_of_fit_limits": {"after": LIMITS},
        "verdict": word,
        "effects": [],
        "unexplained": {"fraction": 0.55, "where": "most at load 3 to 4 N/m"},
        "correction": None,
        "measure": None,
    }
    return made | changes


def test_all_of_it() -> None:
    """Verdict, effects with their values, what is left, the correction, the advice, and errors."""
    effect = {
        "name": "crosstalk",
        "summary": "neighbours are heard",
        "parameters": {
            "crosstalk_share": {"mean": 0.06123, "sd": 0.00234, "unit": ""},
            "crosstalk_width": {"mean": 3.0, "sd": None, "unit": "mm"},
        },
        "indistinguishable_from": ["bleed", "sag"],
    }
    advice = {"advice": "To decide: measure."}
    assert sentences(numbers("partly explained", effects=[effect], correction={}, measure=advice)) == [
        VERDICTS["partly explained"],
        "Found crosstalk (neighbours are heard): crosstalk_share 0.0612 ± 0.0023, crosstalk_width 3 mm. "
        "These data cannot distinguish it from bleed or sag.",
        "Unexplained: 55 % of the misfit, most at load 3 to 4 N/m.",
        "Errors after are with a correction by element and location, which is no cause.",
        "To decide: measure.",
        "On 100 held-out touches: prediction error 1.00 → 0.50 % of the peak (noise alone 0.45), lack of fit 2.00 → "
        "1.02 (0.90 to 1.10 if nothing is missing), bias of R -0.10 → +0.02 mm, coverage of 90 % intervals 80 → 90 %.",
    ]


def test_elements_that_are_left_out_are_named() -> None:
    told = sentences(numbers("adequate", data={"held_out_touches": 100, "elements_left_out": ["e03", "e07"]}))
    assert told[1] == "Left out: e03, e07 (no readings, or the same one in every row)."
    assert not [each for each in sentences(numbers("adequate")) if each.startswith("Left out")]


def test_a_correction_that_was_refused_is_not_said_to_be_used() -> None:
    told = sentences(numbers("partly explained", correction={}, calibration_after={"correction": False}))
    assert not [each for each in told if each.startswith("Errors after are with a correction")]


def test_one_set_of_errors_where_nothing_was_changed() -> None:
    told = sentences(numbers("adequate", before=AFTER))
    assert told == [
        "Adequate: the model predicts held-out touches as well as the noise allows.",
        "On 100 held-out touches: prediction error 0.50 % of the peak (noise alone 0.45), lack of fit 1.02 (0.90 to "
        "1.10 if nothing is missing), bias of R +0.02 mm, coverage of 90 % intervals 90 %.",
    ]
    stated = AFTER | {"R_bias_mm": 0.03}
    against = sentences(numbers(after_against_stated=stated))[-1]
    assert against.startswith(
        "Against references as the data set states them: prediction error 1.00 → 0.50 % of the peak,"
    )
    assert "bias of R -0.10 → +0.03 mm" in against
    nothing = dict.fromkeys(AFTER)
    assert sentences(numbers(before=nothing, after=nothing, after_against_stated=nothing))[-1] == (
        "No touches were held out: errors are not estimated."
    )


def test_the_most_probable_causes() -> None:
    """Three at most, those of one percent or more, and the rest as others."""

    def said(**probability: float) -> str:
        causes = [{"names": name.split("_and_"), "probability": each} for name, each in probability.items()]
        return next(line for line in sentences(numbers(causes=causes)) if line.startswith("Probab"))

    assert said(creep=0.6, creep_and_memory=0.25, nothing=0.1, lag=0.05) == (
        "Probabilities of causes: creep 60 %, creep and memory 25 %, nothing 10 %, others 5 %."
    )
    assert (
        said(creep=0.98, memory=0.009, lag=0.006, nothing=0.005) == "Probabilities of causes: creep 98 %, others 2 %."
    )
    assert said(creep=0.995, memory=0.005) == "Probabilities of causes: creep > 99 %."
    # Files of version 0.1 have none.
    assert not any("Probab" in line for line in sentences(numbers()))


@pytest.mark.parametrize(
    ("key", "before", "after", "worse"),
    [
        # Two standard errors of 0.01.
        ("prediction_error_percent_peak", 1.0, 1.019, False),
        ("prediction_error_percent_peak", 1.0, 1.021, True),
        ("R_bias_mm", -0.1, 0.119, False),
        ("R_bias_mm", 0.1, -0.121, True),
        # Within its limits a lack of fit is none.
        ("lack_of_fit", 0.5, 1.1, False),
        ("lack_of_fit", 0.5, 1.101, True),
        ("lack_of_fit", 2.0, 2.01, False),
        ("coverage_90", 0.9, 0.1, False),
        ("R_bias_mm", 0.1, None, False),
        ("R_bias_mm", None, 0.1, False),
    ],
)
def test_what_is_worse(key: str, before: float | None, after: float | None, worse: bool) -> None:
    stated = AFTER | {key: after}
    made = numbers(before=BEFORE | {key: before}, after=AFTER | {key: after}, after_against_stated=stated)
    assert worse_quantities(made) == ([key] if worse else [])
    assert bool(worse_lines(made)) == worse


def test_without_a_standard_error_any_increase_is_worse() -> None:
    """By more than a billionth."""
    for after, worse in ((1.0 + 5e-10, False), (1.0 + 2e-9, True)):
        stated = AFTER | {"prediction_error_percent_peak": after}
        made = numbers(after=stated, after_against_stated=stated, change_against_stated_se={})
        assert worse_quantities(made) == (["prediction_error_percent_peak"] if worse else [])


def test_references_that_are_said_to_be_off() -> None:
    stated = AFTER | {"R_bias_mm": 0.5}
    (line,) = worse_lines(numbers(after_against_stated=stated))
    assert line == (
        "Worse than before, against references as the data set states them: bias of R -0.10 → +0.50 mm. What was found "
        "says that references are off; where they are right, the calibration before is better."
    )
    (line,) = worse_lines(numbers(after=stated, after_against_stated=stated))
    assert line.endswith("bias of R -0.10 → +0.50 mm.")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "predicts held-out touches as well as the noise allows."),
        ({"after": AFTER | {"lack_of_fit": 0.89}}, "leaves less than the noise that is assumed"),
        ({"after": AFTER | {"lack_of_fit": 0.9}}, "predicts held-out touches as well as the noise allows."),
        ({"lack_of_fit_limits": {"after": LIMITS | {"expected": 1.1}}}, "as well as the noise allows."),
        (
            {"lack_of_fit_limits": {"after": LIMITS | {"expected": 1.11}}},
            "as the noise, and what its fit leaves open, allow.",
        ),
        ({"noise_from_repeats": False}, "the noise is not known from repeats."),
        ({"noise_from_repeats": None, "noise_floor_percent_peak": None}, "the noise is not known from repeats."),
        (
            {"noise_from_repeats": False, "unexplained": {"test": {"ratio": 0.18, "low": 0.69}}},
            "leaves less than the noise, which is not known from repeats: 0.18 of its mean square, at least 0.69 was "
            "expected. So the estimate of the noise is too large, and may hide an error of the model.",
        ),
        (
            {"noise_from_repeats": False, "unexplained": {"test": {"ratio": 0.7, "low": 0.69}}},
            "leaves nothing that these data show; the noise is not known from repeats.",
        ),
        ({"noise_from_repeats": None}, "predicts held-out touches as well as the noise allows."),
        ({"data": {"held_out_touches": 0}}, "Too few touches to say: none were held out, so that nothing was tested."),
        (
            {"data": {"held_out_touches": 0, "unreferenced": True}},
            "Not tested: no touch to be read has references, so that none was held out. By the touches of the fit ",
        ),
        ({"after": AFTER | {"lack_of_fit": None}}, "they cannot be compared with the noise."),
        (
            {"after": AFTER | {"lack_of_fit": None}, "loads_measured": False},
            "they cannot be compared with the noise: the loads were not measured.",
        ),
        ({"after": AFTER | {"lack_of_fit": 1.11}}, "Partly explained: an effect was found, and structure remains"),
    ],
)
def test_sentence_of_the_verdict(changes: dict[str, Any], said: str) -> None:
    assert said in verdict_sentence(numbers(**changes))


def test_nothing_is_said_of_a_model_that_was_not_tested() -> None:
    """No verdict is stated as such, whichever it is; its word stays that of the file."""
    for word in VERDICTS:
        few = numbers(word, data={"held_out_touches": 0}, noise_from_repeats=False)
        assert verdict_sentence(few) == (
            "Too few touches to say: none were held out, so that nothing was tested. By the touches of the fit alone: "
            f"{word}."
        )
        assert verdict_word(few) == word


def test_word_follows_the_lack_of_fit() -> None:
    for word, beyond in (
        ("adequate", "unattributed"),
        ("explained", "partly explained"),
        ("unattributed", "unattributed"),
    ):
        assert verdict_word(numbers(word)) == word
        assert verdict_word(numbers(word, after=AFTER | {"lack_of_fit": 1.11})) == beyond
    # A file of an earlier version states no limits.
    old = numbers("adequate", after=AFTER | {"lack_of_fit": 1.11})
    del old["lack_of_fit_limits"]
    assert verdict_word(old) == "unattributed"
    assert verdict_word(old | {"after": AFTER | {"lack_of_fit": 1.1}}) == "adequate"


def test_every_error_in_its_unit() -> None:
    """Of samples and of touch means where these differ; of a pad beside those of a finger."""
    found = {
        "prediction_error_percent_peak": 1.111,
        "touch_error_percent_peak": 0.888,
        "lack_of_fit": None,
        "R_rms_mm": 0.222,
        "R_bias_mm": -0.333,
        "theta_rms_deg": 0.4444,
        "location_rms_mm": 0.555,
        "P_rms_N_per_m": 66.6,
        "P_rms_N": 0.777,
        "coverage_90": 0.878,
    }
    made = numbers("adequate", before=found, after=found, after_against_stated=found, noise_floor_percent_peak=None)
    assert sentences(made)[-1] == (
        "On 100 held-out touches: prediction error of samples 1.11 % of the peak, prediction error of touch means "
        "0.89 % of the peak, rms error of R 0.22 mm, bias of R -0.33 mm, rms error of the location 0.444 degree, "
        "rms error of the location 0.56 mm, rms error of the load, read without the force sensor, 67 N/m, rms error of "
        "the load, read without the force sensor, 0.78 N, coverage of 90 % intervals 88 %."
    )


def test_limits_that_are_not_known() -> None:
    """No limits are printed, and no lack of fit is beyond them."""
    unknown = {"after": {"low": None, "high": None, "expected": 1.0}}
    told = sentences(numbers(lack_of_fit_limits=unknown))
    assert "lack of fit 2.00 → 1.02, bias" in told[-1]
    assert verdict_word(numbers(lack_of_fit_limits=unknown, after=AFTER | {"lack_of_fit": 9.0})) == "explained"


@pytest.mark.parametrize(
    ("word", "nothing", "tail", "said"),
    [
        ("unattributed", 0.3, 0.00104, True),
        ("unattributed", 0.009, 0.00104, False),
        ("unattributed", 0.3, None, False),
        ("partly explained", 0.3, 0.00104, False),
        ("adequate", 0.3, 0.6, False),
    ],
)
def test_chance_is_named_beside_an_error_that_it_may_make(
    word: str, nothing: float, tail: float | None, said: bool
) -> None:
    causes = [{"names": ["nothing"], "probability": nothing}, {"names": ["creep"], "probability": 1 - nothing}]
    left = {"fraction": 1.0, "where": "nowhere", "p_value": tail}
    line = "Chance may be all of it: without an error, 0.1 % of sensors have a lack of fit as large."
    assert (line in sentences(numbers(word, causes=causes, unexplained=left))) == said


def test_sentences_on_places() -> None:
    """What functions of place gain, and a drift that these data do not distinguish from them."""
    gained = {"times": {"elpd_gain": 120.4, "elpd_gain_se": 20.2}, "places": {"elpd_gain": 80.0, "elpd_gain_se": 30.0}}
    pairs = [["crosstalk", "aperture"], ["baseline_drift", "something in place"]]
    said = sentences(numbers("unattributed", in_place=gained, not_distinguishable=pairs))
    assert any("log density +120 ± 20 across times and +80 ± 30 across places" in line for line in said)
    (line,) = (line for line in said if "not distinguishable" in line)
    assert line.startswith("baseline_drift and something in place are not distinguishable")
    assert not any("place" in line for line in sentences(numbers("unattributed", in_place=None)))


def test_values_of_many_elements_are_summed_up() -> None:
    """Those that all elements have are told one by one; more than twelve are summed up, too."""
    value = {"mean": 0.25, "sd": 0.02, "unit": ""}
    shared = {"channel_lag_share": value, "channel_lag_carry": {"mean": -0.002, "sd": 0.004, "unit": ""}}
    of_elements = {
        f"channel_lag_own_{e:02d}": {"mean": mean, "sd": 0.1} for e, mean in enumerate((0.3, -0.3, 0.1), start=1)
    }
    assert outcome._values(shared) == "channel_lag_share 0.25 ± 0.02, channel_lag_carry -0.002 ± 0.004"
    assert outcome._values(shared | of_elements) == (
        "channel_lag_share 0.25 ± 0.02, channel_lag_carry -0.002 ± 0.004; "
        "of the elements: 3 values, 2 of which are more than 2 standard deviations from 0"
    )
    many = {f"weight_{i}": value for i in range(13)}
    assert outcome._values(many) == "13 values, 13 of which are more than 2 standard deviations from 0"


@pytest.mark.parametrize(
    ("values", "sd", "far"),
    [
        # Distances from the median -0.165 are 1.865, and 0.052 in root mean square without the fifth.
        ((-0.2, -0.21, -0.18, -0.05, 1.7, -0.17, -0.15, -0.16), 0.14, "e05 is far from the others: 1.7 ± 0.14, "),
        ((-0.2, -0.21, -0.18, -0.05, -1.7, -0.17, -0.15, -0.16), 0.14, "e05 is far from the others: -1.7 ± 0.14, "),
        # It is not known, and not far: 4.5 times 0.1.
        ((-0.2, -0.21, -0.18, -0.05, 1.7, -0.17, -0.15, -0.16), 1.0, ""),
        ((0.1, -0.1, 0.1, -0.1, 0.1, -0.1, 0.45), 0.01, ""),
        # Too few to say.
        ((0.0, 0.0, 0.0, 0.0, 1.0), 0.01, ""),
    ],
)
def test_an_element_that_is_far_from_the_others_is_named(values: tuple[float, ...], sd: float, far: str) -> None:
    of_elements = {
        f"gain_nonlinearity_own_{e:02d}": {"mean": mean, "sd": sd, "unit": ""} for e, mean in enumerate(values, start=1)
    }
    said = outcome._values({"gain_nonlinearity_share": {"mean": -0.07, "sd": 0.004, "unit": ""}} | of_elements)
    _, _, after = said.partition(" standard deviations from 0")
    assert after == (f". {far}and these -0.21 to -0.05" if far else "")


def test_small_errors_are_not_printed_as_zero() -> None:
    small = {"prediction_error_percent_peak": 0.000676, "R_rms_mm": 0.00094, "R_bias_mm": -0.0004, "coverage_90": 0.9}
    (said,) = outcome.before_and_after(
        numbers(before=small, after=small, after_against_stated=small, noise_floor_percent_peak=0.00065)
    )
    assert said == (
        "On 100 held-out touches: prediction error 0.000676 % of the peak (noise alone 0.000650), rms error of R "
        "0.000940 mm, bias of R −0.000400 mm, coverage of 90 % intervals 90 %."
    )


def test_draws_that_missed_the_targets_are_said_beside_the_values_they_gave() -> None:
    effect = {"name": "memory", "summary": "", "parameters": {}, "indistinguishable_from": []}
    rough = {"ess_bulk": 36.4, "rhat": 1.121}
    told = sentences(numbers(effects=[effect], draws=rough))
    assert told[1].startswith("Found memory")
    assert told[2] == (
        "The sampler did not reach its targets for the calibration (effective sample size 36, R-hat 1.121), so its "
        "posterior is rough."
    )
    fine = sentences(numbers(effects=[effect], draws={"ess_bulk": 500.0, "rhat": 1.01}))
    assert fine == [*told[:2], *told[3:]] == sentences(numbers(effects=[effect]))
    few = sentences(numbers(effects=[effect], draws={"ess_bulk": 45.0, "rhat": 1.13, "kept": 100}))
    assert few == fine, "100 draws cannot have 400 of effect"
    assert sentences(numbers(draws=rough)) == sentences(numbers()), "no value is stated that they gave"


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("R_rms_mm", "rms error of R 1.00 → 2.00 mm"),
        ("touch_error_percent_peak", "touch_error_percent_peak 1 → 2"),
        ("of_another_version", "of_another_version 1 → 2"),
    ],
)
def test_a_figure_without_words_is_named_by_its_key(key: str, words: str) -> None:
    found = numbers(
        effects=[{"name": "gain_drift"}],
        not_used=[{"effects": ["gain_drift"], "correction": False, "worse": {key: {"before": 1.0, "after": 2.0}}}],
        calibration_after={"effects": [], "correction": False},
    )
    assert f"read worse ({words})" in outcome.not_used(found)


@pytest.mark.parametrize(
    ("stated", "believed", "against"),
    [
        ({"R_rms_mm": 0.4}, True, ""),
        ({"R_rms_mm": 0.4}, False, ""),
        ({"R_rms_mm": 0.5}, True, " against references as they are corrected"),
        ({"R_rms_mm": 0.5}, False, " against references as the data set states them"),
    ],
)
def test_references_are_named_where_what_was_found_moves_them(
    stated: dict[str, float], believed: bool, against: str
) -> None:
    refused = {
        "effects": ["gain_drift"],
        "correction": False,
        "references_corrected": believed,
        "worse": {"R_rms_mm": {"before": 0.3, "after": 0.4}},
        "after": {"R_rms_mm": 0.4},
        "after_against_stated": stated,
    }
    found = numbers(
        effects=[{"name": "gain_drift"}],
        not_used=[refused],
        calibration_after={"effects": [], "correction": False},
    )
    assert outcome.not_used(found) == (
        f"Not used for reading: gain_drift. With it, held-out touches are read worse{against} (rms error of R 0.30 → "
        "0.40 mm), so that calibration_after is without it."
    )
