"""A ``repr`` is a few lines: what the object is, how many of what, and figures that are the object's."""

from __future__ import annotations

import html
import inspect
import re
from collections.abc import Callable, Iterator
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from report_cases import FINGER, LINE, Page

import bayestouch
import bayestouch.reliability
from bayestouch.data.touches import touches_from
from bayestouch.output.summary import Summarised
from bayestouch.priors.parameters import LogNormal
from bayestouch.reading.options import Options
from bayestouch.results import summaries
from bayestouch.results.draws_on_file import DrawsOnFile
from bayestouch.results.partial import fingerprint_of
from bayestouch.simulation import FingerDesign, PadDesign
from bayestouch.simulation_based_calibration.ranks import of_ranks

LONGEST, MOST_LINES = 1000, 12
# Figures are shown with three digits.
ROUNDING = 0.006

Made = dict[str, Any]


def made_from(design: FingerDesign | PadDesign, effect: dict[str, float]) -> Made:
    """What the verbs return for a simulated sensor, without effects and with those that are found."""
    simulated = bayestouch.simulate(design, effects=effect, seed=4)
    data = simulated.dataset
    options: dict[str, Any] = {"draws": 100} if isinstance(design, FingerDesign) else {"kernel": "gaussian"}
    calibration = bayestouch.calibrate(data, **options)
    diagnosis = bayestouch.diagnose(data, sample=False, draws=64)
    after = diagnosis.calibration_after
    return {
        "design": design,
        "simulated": simulated,
        "data": data,
        "check": bayestouch.check(data),
        "touches": data.touches,
        "sensor": data.sensor,
        "body": data.sensor.body,
        "rubber": data.sensor.rubber,
        "calibration": calibration,
        "posteriors": bayestouch.infer(data.touches, calibration, draws=128),
        "summaries": bayestouch.infer(data.touches, calibration, draws=128, summary_only=True),
        "reader": (reader := bayestouch.Reader(calibration)),
        "live touch": reader.read(np.nanmean(data.touches.readings[data.touches.in_contact][:5], axis=0)),
        "log density": bayestouch.log_density(calibration, data),
        "next touches": bayestouch.next_touches(calibration, count=2),
        "diagnosis": diagnosis,
        "calibration with effects": after,
        "posteriors with effects": bayestouch.infer(data.touches, after, draws=128),
    }


@pytest.fixture(scope="module")
def finger() -> Made:
    return made_from(FINGER, {"crosstalk": 0.08})


@pytest.fixture(scope="module")
def pad() -> Made:
    return made_from(replace(LINE, calibration_step_mm=0.5), {"gain_nonlinearity": -0.3})


@pytest.fixture(scope="module")
def others(finger: Made, pad: Made, tmp_path_factory: pytest.TempPathFactory) -> Made:
    """One of every public class that has no body."""
    folder = tmp_path_factory.mktemp("written")
    pair = (finger["calibration"], finger["calibration with effects"])
    return {
        "report": bayestouch.report(pad["data"], folder / "report", diagnosis=False, draws=128),
        "comparison": bayestouch.compare(*pair, folder / "comparison"),
        "ranks": of_ranks({"R": np.arange(100), "P": np.full(100, 99)}, {"R": 0.9, "P": 0.0}),
        "uniform": bayestouch.UniformRadius(),
        "curvature": bayestouch.UniformCurvature(0.5),
        "distribution": bayestouch.IndenterDistribution(LogNormal(2.0, 0.5)),
        "tips": bayestouch.KnownTips((0, 2.5)),
        "edge or round": bayestouch.EdgeOrRound(0.3, bayestouch.UniformCurvature(0.5)),
        "error": bayestouch.InputError("expected a number", file="touches.csv", row=3),
    }


def every(finger: Made, pad: Made, others: Made) -> Iterator[tuple[str, Any]]:
    """All of them, and what their fields and methods give where it is a dataclass of ours."""
    for where, made in (("finger", finger), ("pad", pad), ("", others)):
        for name, each in made.items():
            yield f"{where} {name}", each
            for attribute in fields(each) if is_dataclass(each) else ():
                value = getattr(each, attribute.name)
                if is_dataclass(value) and type(value).__module__.startswith("bayestouch"):
                    yield f"{where} {name}.{attribute.name}", value
        if "touches" in made:
            yield f"{where} averaged", made["touches"].averaged()
            yield f"{where} stand", made["diagnosis"].traced.after
    yield from (("calibration of a report", others["report"].calibration), ("its touches", others["report"].posteriors))


def figure(text: str, pattern: str) -> float:
    """The number that a pattern's group finds in the text of a ``repr``."""
    found = re.search(pattern, " ".join(text.split()))
    assert found, f"{pattern} is not in {text}"
    return float(found[1].replace("−", "-"))


@pytest.mark.slow
def test_one_of_every_public_class_is_looked_at(finger: Made, pad: Made, others: Made) -> None:
    public = {each for name in bayestouch.__all__ if inspect.isclass(each := getattr(bayestouch, name))}
    assert public - {type(each) for _, each in every(finger, pad, others)} == set()
    assert {each.__name__ for each in public if not issubclass(each, Summarised)} == {"InputError"}
    of_reliability = (getattr(bayestouch.reliability, name) for name in bayestouch.reliability.__all__)
    assert all(issubclass(each, Summarised) for each in of_reliability if inspect.isclass(each))


@pytest.mark.slow
def test_every_repr_is_short_and_shows_no_array(finger: Made, pad: Made, others: Made) -> None:
    for name, each in every(finger, pad, others):
        text = repr(each)
        assert type(each).__name__.partition("Statistics")[0] in text or name.endswith("ranks"), name
        assert 0 < len(text) <= LONGEST, (name, len(text))
        assert text.count("\n") < MOST_LINES, name
        assert "array(" not in text and "<" not in text and not re.search(r"(\d[\d.e+-]*,? +){8}", text), (name, text)


@pytest.mark.slow
def test_print_shows_no_array_either(finger: Made, pad: Made, others: Made) -> None:
    for name, each in every(finger, pad, others):
        if type(each).__str__ is object.__str__:
            assert str(each) == repr(each), name
        else:  # sentences; a check has a bar for each element
            assert 0 < len(str(each)) <= 2 * LONGEST and "array(" not in str(each), (name, str(each))


@pytest.mark.slow
def test_every_object_shows_itself_in_a_notebook(finger: Made, pad: Made, others: Made) -> None:
    for name, each in every(finger, pad, others):
        if isinstance(each, Summarised):
            shown = each._repr_html_()
            assert shown.startswith("<") and "array(" not in shown and len(Page(shown).text) > 0, name


@pytest.mark.slow
def test_completion_shows_what_users_need(finger: Made, pad: Made, others: Made) -> None:
    """Every field, and no name that parts of the package use among themselves."""
    for name, each in every(finger, pad, others):
        if isinstance(each, Summarised):
            shown = {attribute for attribute in dir(each) if not attribute.startswith("_")}
            assert not shown & {"summary_lines", "internal"}, name
            own = {field.name for field in fields(each)} if is_dataclass(each) else {"read"}
            assert shown >= {attribute for attribute in own if not attribute.startswith("_")}, name
    for body in (finger["body"], pad["body"]):
        assert "load_column" not in dir(body) and "n_elements" in dir(body) and body.load_column
    assert {"summary", "sel", "mean", "sd", "interval", "save"} <= set(dir(finger["posteriors"]))


def test_large_objects_are_no_longer() -> None:
    many = np.arange(400)
    line = bayestouch.Pad(tuple(0.1 * many))
    large = (
        line,
        bayestouch.Sensor("a long name " * 20, line, reading_quantity="pressure " * 40),
        bayestouch.Finger(9.4, 12.7, 9.9, tuple(0.1 * many)),
        bayestouch.KnownTips(tuple(many)),
        bayestouch.EdgeOrRound(0.5, bayestouch.IndenterDistribution(LogNormal(2.0, 0.5))),
        touches_from(many, np.zeros((400, 300)), indenter_radius_mm=many, angle_deg=many),
        bayestouch.FingerDesign(touch_radii_mm=tuple(0.1 * many)),
        bayestouch.PadDesign(element_x_mm=tuple(0.1 * many), element_y_mm=tuple(0.1 * many)),
        of_ranks({f"parameter {k}": np.arange(100) for k in many}, {f"parameter {k}": 0.9 for k in many}),
        bayestouch.Comparison(Path("folder/" * 60), {"parameters": [], "sentences": ["It differs, and much."] * 90}),
    )
    for each in large:
        assert len(repr(each)) <= LONGEST and repr(each).count("\n") < MOST_LINES, type(each)


@pytest.mark.slow
@pytest.mark.parametrize("body", ["finger", "pad"])
def test_tables_say_how_many(body: str, request: pytest.FixtureRequest) -> None:
    made = request.getfixturevalue(body)
    data, unit = made["data"], {"finger": "N/m", "pad": "N"}[body]
    text = repr(data.touches)
    assert figure(text, r"(\d+) touches") == len(set(data.touches.touch))
    assert figure(text, r"(\d+) rows") == len(data.touches.load)
    assert figure(text, r"(\d+) elements") == data.touches.readings.shape[1]
    lowest = figure(text, rf"load from (\S+) to \S+ {unit}(?:$|\s)")
    assert lowest == pytest.approx(data.touches.load.min(), rel=ROUNDING)
    assert figure(text, r"readings from \S+ to (\S+),") == pytest.approx(data.touches.readings.max(), rel=ROUNDING)
    for name in ("data", "simulated", "check"):
        text = repr(made[name])
        assert repr(data.sensor.name) in text and f"a {body} of {data.sensor.n_elements} elements" in text
        assert figure(text, r"calibration: (\d+) touches") == len(set(data.calibration.touch))
        assert figure(text, rf" touches: .* to (\S+) {unit}(?:$|\s)") == pytest.approx(
            data.touches.load.max(), rel=ROUNDING
        )
    (effect, size), *_ = made["simulated"].truth["effects"].items()
    assert f"effects: {effect} {size:g}" in repr(made["simulated"])


@pytest.mark.parametrize("body", ["finger", "pad"])
@pytest.mark.parametrize("which", ["calibration", "calibration with effects"])
def test_a_calibration_says_its_fit_and_its_parameters(body: str, which: str, request: pytest.FixtureRequest) -> None:
    made = request.getfixturevalue(body)
    calibration = made[which]
    text = repr(calibration)
    assert f"a {body} of {calibration.sensor.n_elements} elements" in text
    assert figure(text, r"(\d+) touches") == len(calibration.rows.touch)
    chains, draws = next(iter(calibration.posterior.values())).shape[:2]
    assert figure(text, r"(\d+) chains of") == chains
    assert figure(text, r"chains of (\d+) draws") == draws
    for name, pattern in (
        ("error_percent_peak", r"error (\S+) % of the peak"),
        ("noise_percent_peak", r"noise (\S+) %"),
        ("lack_of_fit", r"lack of fit (\S+)"),
    ):
        assert figure(text, pattern) == pytest.approx(calibration.statistics[name], rel=ROUNDING)
    name, symbol, unit = {"finger": ("r_s", "r_s", "mm"), "pad": ("gain", "G", "counts/N")}[body]
    means = calibration.posterior[name].mean(axis=(0, 1))
    assert figure(text, rf"{symbol} from (\S+) to") == pytest.approx(means.min(), rel=ROUNDING)
    assert figure(text, rf"{symbol} from \S+ to (\S+) {unit}") == pytest.approx(means.max(), rel=ROUNDING)
    found = made["diagnosis"].effects
    assert found  # an effect was put in, or this says nothing about effects
    assert (f"effects: {', '.join(found)}" in text) == (which == "calibration with effects")


def test_a_sampler_is_named(finger: Made, pad: Made) -> None:
    kinds = ("calibration", "calibration with effects")
    for sampled in (made[kind] for made in (finger, pad) for kind in kinds):
        assert figure(repr(sampled), r"largest R-hat (\S+)") == pytest.approx(sampled.statistics["rhat"], abs=5e-4)


@pytest.mark.parametrize(("body", "names"), [("finger", ("R", "theta_c", "P")), ("pad", ("x", "P"))])
@pytest.mark.parametrize("which", ["posteriors", "summaries", "posteriors with effects"])
def test_posteriors_say_their_grade_and_estimates(
    body: str, names: tuple[str, ...], which: str, request: pytest.FixtureRequest
) -> None:
    posteriors = request.getfixturevalue(body)[which]
    text = repr(posteriors)
    assert figure(text, r"(\d+) touches") == len(posteriors.rows.touch)
    parameters = {each.name: each for each in posteriors.parameters}
    for name in names:
        # the draws themselves where they were kept, not the methods that the repr uses
        draws = posteriors.posterior[name] if which != "summaries" else None
        means = posteriors.estimates[name][0] if draws is None else draws.mean(axis=(0, 1))
        sds = posteriors.estimates[name][1] if draws is None else draws.std(axis=(0, 1))
        symbol, unit = (re.escape(text) for text in (parameters[name].symbol, parameters[name].unit))
        median = figure(text, rf" {symbol}: median ([^\s,]+),")
        assert median == pytest.approx(np.median(means), rel=ROUNDING), name
        assert figure(text, rf" {symbol}: .*? to (\S+) {unit};") == pytest.approx(means.max(), rel=ROUNDING)
        assert figure(text, rf" {symbol}: .*?; median sd (\S+) {unit}") == pytest.approx(np.median(sds), rel=ROUNDING)
    assert ("summaries only" in text) == (which == "summaries")
    n = len(posteriors.rows.touch)
    without = {name: each for name, each in posteriors.sample_stats.items() if name != "beyond_prior"}
    missed, beyond = f"3 of {n} missed the sampler's targets", "are beyond the loads or places of the calibration"
    for poor, outside, expected in (
        (0, None, ["all meet the sampler's targets"]),
        (3, None, [missed]),  # as in files that do not hold the reason
        (3, 0, [missed]),
        (2, 2, [f"2 of {n} {beyond}"]),
        (5, 2, [f"2 of {n} {beyond}", missed]),
    ):
        reason = {} if outside is None else {"beyond_prior": (np.arange(n) < outside).astype(float)}
        stats = {**without, "grade": (np.arange(n) >= poor).astype(float), **reason}
        said = repr(replace(posteriors, sample_stats=stats))
        assert [line.strip() for line in said.splitlines()][2 : 2 + len(expected)] == expected


def test_draws_on_file_are_not_read(finger: Made, tmp_path: Path) -> None:
    """They may be larger than memory, and the file may be gone."""
    posteriors = finger["posteriors"]
    shapes = {name: draws.shape for name, draws in posteriors.posterior.items()}
    away = replace(posteriors, posterior=DrawsOnFile(tmp_path / "gone.nc", shapes, (0, 0)), estimates={})
    chains, draws = shapes["R"][:2]
    assert f"{chains} chains of {draws} draws" in repr(away)


@pytest.mark.parametrize("body", ["finger", "pad"])
def test_a_diagnosis_says_its_verdict(body: str, request: pytest.FixtureRequest) -> None:
    diagnosis = request.getfixturevalue(body)["diagnosis"]
    text = " ".join(repr(diagnosis).split())
    verdict = str(diagnosis).splitlines()[0]
    assert verdict in text and html.escape(verdict) in diagnosis._repr_html_()
    assert f"effects found: {', '.join(diagnosis.effects)}" in text
    after = diagnosis.numbers["after"]["prediction_error_percent_peak"]
    assert figure(text, r"→ (\S+) % of the peak") == pytest.approx(after, abs=0.005)


@pytest.mark.slow
def test_written_results_say_where_and_how_well(others: Made) -> None:
    report, comparison, ranks = (others[name] for name in ("report", "comparison", "ranks"))
    for each in (report, comparison):
        assert str(each.path)[-50:] in repr(each).replace("\n", "").replace("  ", "")
    assert figure(repr(report), r"(\d+) figures") == len(report.figures)
    key = report.numbers["answer"]["key_numbers"][0]
    assert figure(repr(report), rf"{re.escape(key['quantity'])}: (\S+) {key['unit']}") == pytest.approx(
        key["value"], rel=ROUNDING
    )
    assert comparison.numbers["sentences"][0][:60] in " ".join(repr(comparison).split())
    assert figure(repr(ranks), r"Ranks of (\d+) simulations") == 100
    assert figure(repr(ranks), r"normal scores from (\S+)") == pytest.approx(min(ranks.mean_square.values()), rel=0.01)
    assert "not uniform" in repr(ranks)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["calibration", "posteriors", "simulated", "ranks"])
def test_a_notebook_says_the_same(name: str, finger: Made, others: Made) -> None:
    each = (finger | others)[name]
    plain = " ".join(html.unescape(re.sub(r"<[^>]+>", " ", each._repr_html_())).split())
    assert " ".join(repr(each).split()) in plain


def varied(change: Callable[[int], float]) -> bayestouch.KnownTips:
    return bayestouch.KnownTips(tuple(change(k) for k in range(40)))


def test_a_run_that_goes_on_still_sees_every_number_of_its_options() -> None:
    """What is left out of a summary is part of the mark by which a stopped run knows its own file."""
    one, other = varied(float), varied(lambda k: k + 0.25 * (k == 20))
    assert repr(one) == repr(other)
    assert fingerprint_of(Options(indenter=one)) != fingerprint_of(Options(indenter=other))
    assert fingerprint_of(Options(indenter=one)) == fingerprint_of(Options(indenter=varied(float)))


def test_statistics_of_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    """Mean, sd and quantiles between draws by numpy, touch by touch; at a draw where one beside it is infinite."""
    draws = np.random.default_rng(0).standard_normal((4, 15, 7)) ** 3
    draws[0, :, 6] = np.inf
    monkeypatch.setattr(summaries, "_SLICE", 150)  # two touches together, and one that is left over
    found = summaries.summarise({"R": draws, "P": 2 * draws[..., :1]})
    flat = draws.reshape(60, 7)
    wanted = [flat.mean(axis=0), *(flat[:, :6].std(axis=0), *np.quantile(flat[:, :6], [0.05, 0.5, 0.95], axis=0))]
    for row, (one, values) in enumerate(zip(found["R"], wanted, strict=True)):
        np.testing.assert_allclose(one[: len(values)] if row else one, values, rtol=1e-12, err_msg=str(row))
    np.testing.assert_allclose(found["P"][:, 0], 2 * found["R"][:, 0], rtol=1e-12)
    # Fifteen of sixty are infinite: 95 % is. The third and the thirtieth are draws.
    assert np.isnan(found["R"][1, 6]) and found["R"][4, 6] == np.inf
    np.testing.assert_array_equal(found["R"][2:4, 6], np.sort(flat[:, 6])[[2, 29]])
    assert summaries.STATISTICS == ("mean", "sd", "q5", "q50", "q95")
    one = summaries.summarise({"R": np.full((1, 1, 1), 3.0)})["R"][:, 0]
    np.testing.assert_array_equal(one, [3.0, 0.0, 3.0, 3.0, 3.0])
