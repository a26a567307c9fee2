"""The paper's numbers: `bayestouch.paper.published` and a second typing agree with each other and with the paper."""

from __future__ import annotations

import doctest
import math
import re
from pathlib import Path

import pytest
from paper_transcription import TRANSCRIPTION

from bayestouch.paper import published

NUMBERS = list(published.all_numbers())


def plain(text: str) -> str:
    """Text without the mark-up of the machine-read paper: LaTeX commands, bold, table bars, runs of space."""
    text = re.sub(r"\\frac\{([^{}]*)\}\{([^{}]*)\}", r"\1/\2", text)
    text = text.replace(r"\alpha", "α").replace(r"\{", "{").replace(r"\}", "}")
    text = re.sub(r"\\mathbf\{([^{}]*)\}|\\mathbf", r"\1", text)
    text = re.sub(r"\\in\b", "∈", text)
    text = re.sub(r"[$*]", "", text)
    text = re.sub(r"\^\{?\\circ\}?", "°", text)
    return " ".join(text.split())


@pytest.fixture(scope="module")
def paper(shared_folder: Path) -> str:
    source = shared_folder / "paper" / "nicolson-fearing-1995.txt"
    if not source.is_file():
        pytest.skip(f"the paper's text is not in the shared folder ({source.name})")
    return plain(source.read_text(encoding="utf-8"))


def stands_alone(number: str, words: str) -> bool:
    """Whether the literal is a number of its own there: 0.9 is not found inside 0.95."""
    return re.search(rf"(?<![\d.]){re.escape(number)}(?!\.?\d)", words) is not None


@pytest.mark.parametrize("item", NUMBERS, ids=lambda item: item.key)
def test_number_is_the_one_that_was_typed_from_the_paper(item: published.PublishedNumber) -> None:
    """The same number, unit, place and words in two typings: that of the package and that of the tests."""
    places = [typed for typed in TRANSCRIPTION if typed.key == item.key]
    assert {(typed.printed, typed.value, typed.unit) for typed in places} == {(item.printed, item.value, item.unit)}
    quote = plain(item.quote)
    assert any(typed.where == item.where and typed.words in quote for typed in places)
    assert stands_alone(item.printed, item.quote)


def test_both_typings_hold_the_same_numbers() -> None:
    assert {typed.key for typed in TRANSCRIPTION} == {item.key for item in NUMBERS}


def test_both_typings_are_in_the_paper(paper: str) -> None:
    """Every quote of the package and all words of the transcription, with its number by itself in them."""
    quotes = {plain(part) for item in NUMBERS for part in item.quote.split(" … ")}
    assert {words for words in quotes if words not in paper} == set()
    assert {typed for typed in TRANSCRIPTION if typed.words not in paper} == set()
    assert {typed for typed in TRANSCRIPTION if not stands_alone(typed.printed, typed.words)} == set()


def test_no_number_of_the_text_is_left_out(paper: str) -> None:
    """Sections 2 to 5, less the quotes, references and formulas, hold no number."""
    body = paper[paper.index("Linear elastic tactile sensor model") : paper.index("Acknowledgements")]
    quotes = {plain(part) for item in NUMBERS for part in item.quote.split(" … ")}
    for quote in sorted(quotes, key=len, reverse=True):
        body = body.replace(quote, " ")
    for other in (
        r"\[[\d, ]+\]",  # literature
        r"\b(Figures?|Tables?|Sections?) \d+(\.\d)?( and \d+)?",
        r"(?<= )\d(\.\d)? (?=[A-Z])",  # headings
        r"\\quad \(\d\)",  # equation numbers
        r"1/R = 1/r_b \+ 1/r_c|period 2π|k=1|\)\^2",
        r"2n_c ?\+ ?1|4n_c ?\+ ?2|n_s-1|\^\{?-1\}?",  # sizes and inverses
    ):
        body = re.sub(other, " ", body)
    assert re.findall(r"(?<![\w.{_])\d+(?:\.\d+)?", body) == []


def test_keys_are_unique_and_found() -> None:
    assert len({item.key for item in NUMBERS}) == len(NUMBERS)
    for item in NUMBERS:
        assert published.number(item.key) is item
    with pytest.raises(KeyError):
        published.number("shear_modulus")


def test_the_examples_of_the_docstring() -> None:
    failed, attempted = doctest.testmod(published)
    assert attempted >= 3 and failed == 0


def test_counts() -> None:
    per_table = {table: sum(item.where.startswith(f"Table {table}, row") for item in NUMBERS) for table in "1234"}
    assert per_table == {"1": 4 * 3, "2": 3, "3": 9 * 5, "4": 6 * 3}


def test_tables_hold_the_same_numbers_as_the_list() -> None:
    for row in published.TABLE_1 + published.TABLE_2:
        table = "table_2" if row in published.TABLE_2 else "table_1"
        for column, value in (("min", row.minimum), ("avg", row.average), ("max", row.maximum)):
            item = published.number(f"{table}.{row.quantity}.{column}")
            assert (item.value, item.unit) == (value, row.unit)
    for radius in published.TABLE_3:
        for name, value in vars(radius).items():
            assert published.number(f"table_3[{radius.r_c:.2f}].{name}").value == value
    for error in published.TABLE_4:
        for name in ("theta_c", "P", "R"):
            key = f"table_4.{error.calibration}.{error.part}.{name}"
            assert published.number(key).value == getattr(error, name)


def test_rounding_is_half_a_unit_of_the_last_printed_digit() -> None:
    for key, expected in (
        ("spacing", 0.005),
        ("touches.load", 0.5),
        ("cutoff.level", 0.5),
        ("cutoff.deep", 0.05),
    ):
        assert published.number(key).rounding == pytest.approx(expected, rel=1e-12)
    assert published.number("location_error.over_spacing").rounding == 0
    assert published.number("radius_error.r_c_over_R").rounding == 0


# ---- what the paper's numbers say about each other


def test_table_1_and_2_are_ordered() -> None:
    for row in published.TABLE_1 + published.TABLE_2:
        assert row.minimum < row.average < row.maximum


@pytest.mark.parametrize(
    ("key", "same_as"),
    [
        ("fit_error.model", "table_1.error.avg"),
        ("fit_error.empirical", "table_2.error.avg"),
        ("radius_error.noise", "table_4.empirical.noise.R"),
        ("radius_error.averaged", "table_4.empirical.location.R"),
        ("tips.smallest", "table_3[1.59].r_c"),
        ("tips.largest", "table_3[25.25].r_c"),
        ("location_error.over_spacing_conclusion", "location_error.over_spacing"),
        ("table_4.n_touches_caption", "table_4.n_touches"),
        ("figure_3.load", "touches.load"),
    ],
)
def test_what_is_printed_twice_agrees(key: str, same_as: str) -> None:
    assert published.number(key).value == published.number(same_as).value


@pytest.mark.parametrize("calibration", ["model", "empirical"])
@pytest.mark.parametrize("name", ["theta_c", "P", "R"])
def test_table_4_parts_add_in_quadrature(calibration: str, name: str) -> None:
    """total² = location² + noise² within the rounding of all three, but in three cells named in `NOTES`."""
    total, location, noise = (
        published.number(f"table_4.{calibration}.{part}.{name}") for part in ("total", "location", "noise")
    )
    low = math.hypot(location.value - location.rounding, noise.value - noise.rounding)
    excess = low - (total.value + total.rounding)  # positive: no rounding brings the parts down to the total
    misfits = {("model", "P"): 0.0069, ("model", "R"): 0.0024, ("empirical", "R"): 0.0041}
    if (calibration, name) in misfits:
        assert excess == pytest.approx(misfits[calibration, name], abs=5e-5)
    else:
        high = math.hypot(location.value + location.rounding, noise.value + noise.rounding)
        assert low <= total.value + total.rounding
        assert high >= total.value - total.rounding


def test_averaged_noise_is_the_raw_noise_over_the_root_of_the_samples() -> None:
    raw, averaged = published.number("table_1.noise_level.avg"), published.number("noise.averaged_readings")
    expected = raw.value / math.sqrt(published.number("touches.n_samples").value)
    assert abs(expected - averaged.value) <= averaged.rounding


def value(key: str) -> float:
    return published.number(key).value


# one line a claim of NOTES: what the note says, computed here from the printed numbers
CLAIMS = {
    "0.64 %": math.hypot(value("noise.force_sensor"), value("noise.averaged_readings")),
    "3.4 times": value("fit_error.model") / math.hypot(value("noise.force_sensor"), value("noise.averaged_readings")),
    "13.23 against": math.hypot(value("table_4.model.location.P"), value("table_4.model.noise.P")),
    "1.274 against": math.hypot(value("table_4.model.location.R"), value("table_4.model.noise.R")),
    "0.976 against": math.hypot(value("table_4.empirical.location.R"), value("table_4.empirical.noise.R")),
    "0.053 mm": math.radians(value("table_4.model.total.theta_c")) * value("outer_radius"),
    "29 of 1.52 mm": value("spacing") / (math.radians(value("table_4.model.total.theta_c")) * value("outer_radius")),
    "37 at r_s": value("spacing") / (math.radians(value("table_4.model.total.theta_c")) * value("sensing_radius")),
    "factor of 0.58": value("table_4.model.noise.theta_c") / value("table_4.model.total.theta_c"),
    "6.6 %": 100 * value("table_4.model.total.P") / value("touches.load"),
    "5.9 %": 100 * value("table_4.empirical.total.P") / value("touches.load"),
    "1.4 standard deviations": value("radius_error.distinguishable") / (math.sqrt(2) * value("radius_error.noise")),
    "83 %": 100
    * math.erf(value("radius_error.distinguishable") / (math.sqrt(2) * value("radius_error.noise")) / 2**0.5),
    "2.1 mm": 1.959964 * math.sqrt(2) * value("radius_error.noise"),
}


@pytest.mark.parametrize("words", CLAIMS)
def test_notes_state_what_the_numbers_give(words: str) -> None:
    assert any(words in note.finding for note in published.NOTES)
    stated = words.split()[-1] if words.startswith("factor") else words.split()[0]
    decimals = len(stated.partition(".")[2])
    # the note rounds, and 6.55 % may round either way in binary: half a unit and a hair
    assert CLAIMS[words] == pytest.approx(float(stated), abs=0.5 * 10.0**-decimals * 1.0001)


def test_radius_error_grows_fourfold_at_r_c_equal_to_r_b() -> None:
    """Central difference of r_c(R) = 1/(1/R - 1/r_b); its error is of order step², 1e-6 of the slope here."""
    r_b, step = value("outer_radius"), 1e-3

    def r_c(composite: float) -> float:
        return 1 / (1 / composite - 1 / r_b)

    slope = (r_c(r_b / 2 + step) - r_c(r_b / 2 - step)) / (2 * step)
    assert slope == pytest.approx(4, rel=1e-6)
    assert value("radius_error.r_c_over_R") == 2


def test_hertz_estimates_are_low_and_the_frictionless_ones_less_biased() -> None:
    """Table 3, section 4: Hertz underestimates from 3.9 mm up; the other is better up to 13 mm."""
    round_tips = [row for row in published.TABLE_3 if row.r_c >= 3.9]
    assert all(max(row.hertz_model, row.hertz_empirical) < row.r_c for row in round_tips)
    small = [row for row in round_tips if row.r_c <= value("table_3.unbiased_to")]

    def mean_error(column: str) -> float:
        return sum(abs(getattr(row, column) - row.r_c) for row in small) / len(small)

    assert mean_error("frictionless_model") < mean_error("hertz_model") / 3
    assert mean_error("frictionless_empirical") < mean_error("hertz_empirical") / 3
