"""Settings that the documentation quotes are those of the code: each sentence is written out here from the constant."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bayestouch.baselines import reading as baselines
from bayestouch.data import parquet, tables, toml_text, touch_source
from bayestouch.diagnosis import (
    blocks,
    choice,
    comparison,
    harm,
    one_round,
    place_or_time,
    search,
    shared_drift,
    verdict,
)
from bayestouch.finger import noise_with_effects, priors
from bayestouch.finger.reading import alternatives, profile
from bayestouch.model import split_data as parted
from bayestouch.pad import density
from bayestouch.reading import check, driver, fault_tests, faults
from bayestouch.reporting import diagnosis_file, touch_list
from bayestouch.results import hdf5_reading

DOCS = Path(__file__).resolve().parents[2] / "docs"
MEGA, MEBI = 10**6, 2**20
WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten")
SHARES = {3: "third", 4: "quarter", 5: "fifth", 10: "tenth"}


def share(value: float) -> str:
    """In words."""
    return SHARES[round(1 / value)]


QUOTED = {
    "robustness.md": [
        f"Each of up to {check.MOST} touches",
        f"A gain or an offset more than {100 * fault_tests.TOLERANCE:g} % (the force sensor: "
        f"{100 * fault_tests.FORCE_TOLERANCE:g} %)",
        f"beyond {WORDS[int(fault_tests.THRESHOLD)]} standard deviations",
        f"A scatter {fault_tests.SCATTER:g} times that of the others is a fault",
        f"each of the {WORDS[faults.MOST_TRIED]} worst elements is left out once",
        f"Where more than a {share(faults.LARGEST_SHARE)} of the elements would have to go",
        f"Fewer than {WORDS[fault_tests.FEWEST]} touches are not judged",
        f"checked only if it reads a {share(fault_tests.SIGNAL_SHARE)} of its peak, or more, in at least "
        f"{WORDS[fault_tests.FEWEST_SIGNALS]} touches",
        f"more than {hdf5_reading.LARGEST_RATIO} times the size of the file (and {hdf5_reading.FREE_BYTES // MEBI} MB) "
        "is refused",
        f"more than {parquet.LARGEST_RATIO} times its file (and {parquet.FREE_BYTES // MEBI} MB) is refused",
        f"at most {tables.MAX_BYTES // 2**30} GB, {tables.MAX_COLUMNS:,} columns",
        f"at most {toml_text.MAX_BYTES // MEGA} MB, and at most {toml_text.MAX_PARTS} parts to a key",
        f"at most {diagnosis_file.MAX_BYTES // MEGA} MB, {diagnosis_file.MOST_ENTRIES:,} entries to a list",
    ],
    "statistics.md": [
        f"log-normal about {priors.DISCREPANCY.median:g} within a factor of 3",
        f"up to {noise_with_effects.MOST_READINGS:,} readings of samples, if no other noise effect is in the model",
        f"up to {density.MOST_READINGS:,} mean readings (touches times elements); else independent",
        f"with up to {density.MOST_READINGS:,} mean readings, size and correlation time of drifts",
        f"by {alternatives.EVIDENCE_POINTS} lattice points",
        f"(Pareto $\\hat k > {alternatives.LARGEST_K:g}$)",
        f"So it is tabulated at {profile.KNOTS} knots over {profile.REACH:g} standard deviations either way",
    ],
    "diagnosis.md": [
        f"If fewer than {parted.ENOUGH_READ} touches of `touches.csv` have references, every fourth calibration touch",
        f"Where these are fewer than {parted.ENOUGH_CALIBRATION} ",
        f"$1 - (1 - p)^M < {one_round.CHANCE:g}$ (Šidák)",
        f"The {WORDS[one_round.LEADING]} best are added to the model one at a time",
        f"less than {1e4 * comparison.ROUGHLY:g}·10⁻⁴ of what there is to explain",
        f"dealt into {WORDS[comparison.FOLDS]} folds",
        f"it gains at least {WORDS[int(search.ERRORS)]} standard errors",
        f"an effect with a size of a {share(one_round.MATERIAL)} of the noise",
        f"at least {100 * one_round.SHARE:g} % of what can be explained",
    ],
    "large.md": [
        f"A file of more than {touch_source.READ_WHOLE // MEBI} MB is read in pieces of {tables.CHUNK:,} rows",
        f"Pieces that take up to {touch_source.ROOM // MEBI} MB in memory",
        f"({driver.BLOCK_DRAWS // 1024:,} touches at 1,024 draws)",
    ],
    "report.md": [
        f"More than {touch_list.MOST_TOUCHES} touches are thinned evenly",
        f"asked at {baselines.LOCATIONS[1]} locations and {baselines.LOADS_ASKED[1]} loads on a line, and at "
        f"{baselines.LOCATIONS[2]} locations along each axis and {baselines.LOADS_ASKED[2]} loads in a plane",
        f"a grid {WORDS[baselines.FINER]} times finer along each axis, and at {baselines.LOADS[1]} loads on a line and "
        f"{baselines.LOADS[2]} in a plane",
    ],
}


@pytest.mark.parametrize(("page", "sentence"), [(page, one) for page, some in QUOTED.items() for one in some])
def test_a_setting_is_quoted_as_it_is(page: str, sentence: str) -> None:
    """A constant that changes makes this fail until the page says the new value."""
    text = " ".join((DOCS / page).read_text("utf-8").replace("\n* ", "\n").split())
    assert " ".join(sentence.split()) in text


#: Modules of the search and the verdict whose numbers are limits that were set by hand.
OF_DIAGNOSIS = (blocks, choice, comparison, harm, one_round, place_or_time, search, shared_drift, verdict)
#: Fractions of the time of a round: they are for the progress bar.
NO_LIMITS = {"one_round.SCORED", "one_round.REFITTED", "one_round.CORRECTED"}


def test_all_limits_of_the_diagnosis_are_in_its_table() -> None:
    """Each number that is defined in these modules has a row with its value and a reason, and no row has another."""
    page = (DOCS / "diagnosis.md").read_text("utf-8").partition("### Limits that are set by hand")[2]
    rows = re.findall(r"^\| [^|]+ \| ([\d.]+) \| `(\w+\.[A-Z_]+)` \| ([^|]+) \|$", page.partition("\n### ")[0], re.M)
    quoted = {constant: float(value) for value, constant, _ in rows}
    defined = {}
    for module in OF_DIAGNOSIS:
        source = Path(module.__file__).read_text("utf-8")
        for names in re.findall(r"^([A-Z_]+(?:, [A-Z_]+)*) = ", source, re.M):
            for name in names.split(", "):
                value = getattr(module, name)
                if isinstance(value, int | float):
                    defined[f"{module.__name__.rpartition('.')[2]}.{name}"] = value
    assert quoted == {name: value for name, value in defined.items() if name not in NO_LIMITS}
    assert len(rows) == len(quoted) and all(reason.strip() for *_, reason in rows)
