"""The public function: what it returns for each question, and what it refuses."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import bayestouch
from bayestouch.reliability.candidate_touches import touches_to_read
from bayestouch.reliability.two_causes import TwoCauses

DESIGN = bayestouch.FingerDesign(
    n_elements=6,
    calibration_span_deg=30.0,
    edge_step_deg=3.0,
    flat_step_deg=6.0,
    touch_step_deg=5.0,
    samples_per_touch=5,
)


@cache
def diagnosed() -> bayestouch.Diagnosis:
    dataset = bayestouch.simulate(DESIGN, effects={"crosstalk": 0.03}, seed=3).dataset
    return bayestouch.diagnose(dataset, draws=200, sample=False)


@cache
def calibrated(body: str) -> bayestouch.Calibration:
    if body == "finger":
        return diagnosed().calibration_before
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 6.0, 12.0), element_y_mm=None, calibration_step_mm=1.0, n_touches=30
    )
    return bayestouch.calibrate(bayestouch.simulate(design, seed=3).dataset, kernel="gaussian", draws=200)


@pytest.mark.parametrize("body", ["finger", "pad"])
@pytest.mark.parametrize("about", ["calibration", "places"])
def test_chosen_touches_lower_the_expected_sds(body: str, about: str) -> None:
    one = calibrated(body)
    table = bayestouch.candidate_touches(one)
    found = bayestouch.next_touches(one, table, count=6, about=about)
    assert found.gain.shape == (6, table.n_touches) and len(set(found.chosen.tolist())) == 6
    assert (found.after[-1] < found.before).all()
    # After each step, the mean relative variance has fallen by the gain of the chosen touch.
    left = np.mean((np.vstack([found.before, found.after]) / found.before) ** 2, axis=1)
    np.testing.assert_allclose(-np.diff(left), found.gain[np.arange(6), found.chosen], rtol=1e-8)
    columns = one.sensor.body.location_columns
    for column in columns:
        np.testing.assert_array_equal(getattr(found.touches, column), getattr(table, column)[found.chosen])
    frame = found.to_dataframe()
    assert frame.index.tolist() == found.chosen.tolist()
    np.testing.assert_array_equal(frame[f"{found.quantities[0]}_sd"], found.after[:, 0])
    assert "NextTouches" in repr(found) and len(repr(found)) < 1000
    assert found.quantities[0] in found._repr_html_()


def test_a_place_is_told_by_touches_near_it() -> None:
    one = calibrated("pad")
    read = bayestouch.candidate_touches(one, places=[3.0])
    found = bayestouch.next_touches(one, count=2, about="places", places=read)
    assert found.touches.x_mm is not None
    assert (np.abs(found.touches.x_mm - 3.0) < 4.0).all()


def test_quantities_are_those_that_are_named() -> None:
    one = calibrated("finger")
    every = bayestouch.next_touches(one, count=4)
    alone = bayestouch.next_touches(one, count=4, quantities=("mu",))
    np.testing.assert_array_equal(bayestouch.next_touches(one, count=4, quantities="mu").after, alone.after)
    assert alone.quantities == ("mu",) and alone.after[-1, 0] <= every.after[-1, 1] * (1 + 1e-9)
    angle = bayestouch.next_touches(one, about="places", quantities=("theta_c", "P"))
    assert angle.quantities == ("theta_c", "P") and angle.units == ("degree", "N/m")


@pytest.mark.parametrize("body", ["finger", "pad"])
def test_touches_are_read_between_the_elements(body: str) -> None:
    one = calibrated(body)
    table = touches_to_read(one)
    column = one.sensor.body.location_columns[0]
    place = getattr(table, column)
    nominal = np.array(getattr(one.sensor.body, one.sensor.body.elements_key))
    step = np.diff(np.sort(np.unique(next(iter(one.rows.location.values()))))).max()
    # An element is at the nearest touch of the calibration.
    assert abs(place.min() - nominal.min()) <= step and abs(place.max() - nominal.max()) <= step


def test_causes_of_a_diagnosis() -> None:
    found = bayestouch.next_touches(diagnosed(), count=5, about=("crosstalk", "gain_drift"))
    assert found.about == "crosstalk or gain_drift" and found.quantities == ("log_bayes_factor",)
    assert found.before[0] == 0 and (np.diff(found.after[:, 0]) > 0).all()
    turned = bayestouch.next_touches(diagnosed(), count=5, about=("gain_drift", "crosstalk"))
    np.testing.assert_allclose(turned.after, found.after, rtol=1e-6)


def test_an_effect_that_is_there_is_told_from_nothing_and_from_functions_of_place() -> None:
    for other in ("nothing", "something in place"):
        found = bayestouch.next_touches(diagnosed(), count=5, about=("crosstalk", other))
        assert found.after[-1, 0] > 2


def with_causes(probabilities: dict[tuple[str, ...], float]) -> bayestouch.Diagnosis:
    """The diagnosis, which found crosstalk, with other probabilities of the causes."""
    causes = [{"names": list(names), "probability": each} for names, each in probabilities.items()]
    return replace(diagnosed(), numbers={**diagnosed().numbers, "causes": causes})


@pytest.mark.parametrize(
    ("probabilities", "pair", "title"),
    [
        # The title was "nothing or creep".
        (
            {("crosstalk",): 0.6, ("something else",): 0.2, ("crosstalk", "creep"): 0.2},
            ("nothing", "creep"),
            "crosstalk, or crosstalk and creep",
        ),
        ({("crosstalk",): 0.9, ("nothing",): 0.1}, ("crosstalk", "nothing"), "crosstalk or nothing"),
        (
            {("something else",): 0.5, ("crosstalk",): 0.3, ("something in place",): 0.2},
            ("crosstalk", "something in place"),
            "crosstalk or something in place",
        ),
    ],
)
def test_the_probable_causes_are_named_as_sets(
    probabilities: dict[tuple[str, ...], float], pair: tuple[str, str], title: str
) -> None:
    question = TwoCauses.probable(with_causes(probabilities))
    assert question.causes == pair
    before = () if "crosstalk" in pair else ("crosstalk",)
    assert question.found.before.names == before
    assert bayestouch.next_touches(with_causes(probabilities), about="causes").about == title


@pytest.mark.parametrize(
    ("probabilities", "words"),
    [
        (
            {("crosstalk",): 0.88, ("something else",): 0.11, ("crosstalk", "creep"): 0.0008},
            "about: the causes that were tried are settled: the probability of crosstalk is 88 %, that of every other "
            "one less than 1 %; name two causes to compare them all the same",
        ),
        ({("something else",): 1.0}, "about: the diagnosis has no two causes to compare; name two"),
        (
            {("crosstalk",): 0.8, ("crosstalk", "creep", "memory"): 0.2},
            "about: the diagnosis has no two causes to compare; name two",
        ),
    ],
)
def test_causes_that_are_no_question_are_refused(probabilities: dict[tuple[str, ...], float], words: str) -> None:
    with pytest.raises(bayestouch.InputError) as error:
        bayestouch.next_touches(with_causes(probabilities), about="causes")
    assert str(error.value) == words


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"about": "sigma"}, "expected calibration, places, causes"),
        ({"about": ("crosstalk", "crosstalk")}, "two different causes"),
        ({"about": ("crosstalk", "cross_talk")}, "did you mean crosstalk"),
        ({"about": ("crosstalk", "outliers")}, "unknown cause 'outliers'"),
        ({"about": ("crosstalk",)}, "two names of causes"),
        ({"quantities": ("sigma", "nu")}, "names among sigma, mu, r_s, got 'nu'"),
        ({"quantities": "sigmas"}, r"names among sigma, mu, r_s, got 'sigmas'; did you mean sigma\?$"),
        ({"quantities": 3}, "names among sigma, mu, r_s, got 3"),
        ({"quantities": ()}, r"names among sigma, mu, r_s, got \(\)"),
        ({"about": "places", "quantities": ("mu",)}, "names among R, theta_c, P"),
        ({"count": 0}, "count: expected from 1 to"),
        ({"count": 1000}, "count: expected from 1 to"),
    ],
)
def test_bad_options_are_named(changes: dict[str, object], words: str) -> None:
    with pytest.raises(bayestouch.InputError, match=words):
        bayestouch.next_touches(diagnosed(), **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"count": 2.5}, "count: expected from 1 to"),
        ({"about": None}, "about: expected two names of causes, got None"),
        ({"places": "nonsense"}, 'places: expected with about="places" only'),
        ({"about": "places", "places": "nonsense"}, "places: expected Touches, .* got str"),
        ({"candidates": [1.0]}, "candidates: expected Touches, .* got list"),
        ({"about": "causes", "quantities": ("mu",)}, "quantities: expected with standard deviations only"),
    ],
)
def test_options_that_would_not_be_used_are_named(changes: dict[str, object], words: str) -> None:
    with pytest.raises(bayestouch.InputError, match=words):
        bayestouch.next_touches(calibrated("pad"), **changes)  # type: ignore[arg-type]


def test_touches_of_another_sensor_are_refused() -> None:
    pad, m = calibrated("pad"), calibrated("finger").sensor.n_elements
    other = bayestouch.candidate_touches(calibrated("finger"))
    for changes in ({"candidates": other}, {"about": "places", "places": other}):
        (name,) = changes.keys() - {"about"}
        words = f"{name}: expected touches of {pad.sensor.n_elements} elements, got {m}"
        with pytest.raises(bayestouch.InputError, match=words):
            bayestouch.next_touches(pad, **changes)  # type: ignore[arg-type]


def test_a_table_names_the_unit_of_each_column() -> None:
    frame = bayestouch.next_touches(calibrated("pad"), count=2, about="places").to_dataframe()
    units = {"tip": "mm", "x_mm": "mm", "load": "N", "gain": "", "x_sd": "mm"}
    assert frame.attrs["units"] == units and set(frame.columns) == {*units, "samples"}


def test_loads_that_were_not_measured_have_no_unit() -> None:
    design = bayestouch.PadDesign(
        element_x_mm=(0.0, 6.0, 12.0), element_y_mm=None, calibration_step_mm=1.0, n_touches=30
    )
    known = bayestouch.simulate(design, seed=3).dataset
    table = known.calibration
    assert table is not None
    table = table.with_(load=np.full(table.n_rows, np.nan))
    calibration = bayestouch.calibrate(replace(known, calibration=table), kernel="gaussian", draws=200)
    chosen = bayestouch.next_touches(calibration, about="places", quantities=["x", "P"])
    assert chosen.units == ("mm", "") and chosen.to_dataframe().attrs["units"]["load"] == ""
    assert chosen.summary_lines()[1].endswith("load 1")


def test_bad_sources_and_candidates_are_named() -> None:
    one = calibrated("finger")
    with pytest.raises(bayestouch.InputError, match="causes are compared for a diagnosis"):
        bayestouch.next_touches(one, about=("crosstalk", "nothing"))
    with pytest.raises(bayestouch.InputError, match="expected a calibration or a diagnosis, got str"):
        bayestouch.next_touches("calibration.nc")  # type: ignore[arg-type]
    table = bayestouch.candidate_touches(one)
    with pytest.raises(bayestouch.InputError, match="no touch to choose from"):
        bayestouch.next_touches(one, table.select([]))
    with pytest.raises(bayestouch.InputError, match="6 elements, got 3"):
        bayestouch.next_touches(one, bayestouch.candidate_touches(calibrated("pad")))


def test_samples_are_rows_of_a_touch_or_reads() -> None:
    one = calibrated("finger")
    table = bayestouch.candidate_touches(one, places=[0.0], tips_mm=[0.0], samples=4)
    rows = table.select([0, 0, 0, 0]).with_(reads=None, sample=np.arange(4))
    first, second = (bayestouch.next_touches(one, each) for each in (table, rows))
    np.testing.assert_allclose(first.after, second.after, rtol=1e-12)
    assert second.touches.reads is not None and second.touches.reads.tolist() == [4]


@pytest.mark.parametrize(
    ("changes", "words"),
    [({"places": [[0.0, 1.0]]}, "places"), ({"samples": 0}, "samples"), ({"loads": [-1.0]}, "loads")],
)
def test_a_bad_grid_is_named(changes: dict[str, object], words: str) -> None:
    with pytest.raises(bayestouch.InputError, match=words):
        bayestouch.candidate_touches(calibrated("finger"), **changes)  # type: ignore[arg-type]
