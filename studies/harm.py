"""Readings that a diagnosis made worse, by any files of results: R, location or load beyond two standard errors.

It reads results of `blind_study` (exams against what is true), `places_and_times` and `error_rates` (held-out touches,
against references as the data set states them), and counts those of `causes`, where no touch was read. Where an effect
that was found moves references, the error against references as corrected is in a column of its own: if the effect is
right, that is the error.

    python studies/harm.py FILE [FILE ...]

Results of one version of the code are read of each file, that of the last result; the tables say which.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parents[1] / "tests")]

from _error_rate_versions import newest, version_of  # noqa: E402
from _page import markdown_table  # noqa: E402
from _result_lines import kept_lines  # noqa: E402

Record = Mapping[str, Any]
# A reading is worse if its error grew by more than so many standard errors.
WORSE = 2.0
#: Errors of readings in a diagnosis, with their units.
UNITS = {
    "R_rms_mm": "mm",
    "R_bias_mm": "mm",
    "theta_rms_deg": "degree",
    "location_rms_mm": "mm",
    "P_rms_N_per_m": "N/m",
    "P_rms_N": "N",
}
EXAM_UNITS = {"R": "mm", "theta_c": "degree", "P": "N/m"}


@dataclass(frozen=True)
class Reading:
    """Error of one quantity of one finger, before and after.

    Attributes
    ----------
    case : str
        What was simulated.
    quantity, unit : str
    before, after : float
        Errors, a bias without its sign.
    standard_errors : float
        Change of the error (of its square in an exam) in units of its standard error; infinite if that is zero.
    corrected : float or None
        Error after against references as corrected; None where it is the same, and in an exam.
    """

    case: str
    quantity: str
    unit: str
    before: float
    after: float
    standard_errors: float
    corrected: float | None = None

    @property
    def worse(self) -> bool:
        """Whether it is worse beyond chance."""
        return self.standard_errors > WORSE


def readings(record: Record) -> Iterator[Reading]:
    """All readings of a result; none of one without errors before and after."""
    case = name_of(record)
    for quantity, error in record.get("exam", {}).items():
        times = in_errors(error["change"], error["standard_error"])
        yield Reading(case, quantity, EXAM_UNITS[quantity], error["before"], error["after"], times)
    numbers = record.get("diagnosis", record)
    if "exam" in record or "change_against_stated_se" not in numbers:
        return
    for key, unit in UNITS.items():
        values = [numbers[part].get(key) for part in ("before", "after_against_stated", "after")]
        if values[0] is None or values[1] is None:
            continue
        before, after = (abs(float(each)) for each in values[:2])
        times = in_errors(after - before, numbers["change_against_stated_se"].get(key) or 0.0)
        moved = values[2] is not None and values[2] != values[1]
        yield Reading(case, key, unit, before, after, times, abs(values[2]) if moved else None)


def in_errors(change: float, standard_error: float) -> float:
    """Change in units of its standard error; 0 without a change."""
    if abs(change) < 1e-12:
        return 0.0
    return change / standard_error if standard_error > 0 else float("inf") * (1 if change > 0 else -1)


def name_of(record: Record) -> str:
    """What was simulated, and on which finger."""
    effects = " + ".join(f"{key.rstrip(': ')} {size:g}" for key, size in record.get("effects_of_case", ()))
    parts = [record["kind"], effects, *(str(record[key]) for key in ("rubber", "order", "design") if key in record)]
    if "percent" in record:
        parts.append(f"{record['percent']:g} %")
    return ", ".join(filter(None, [*parts, f"seed {record['seed']}"]))


def as_case(record: Record) -> dict[str, Any]:
    """A result whose simulated effects are apart from those that were found, which `places_and_times` stores so."""
    simulated = () if "percent" in record else record.get("effects", ())
    return {**record, "effects_of_case": [tuple(each) for each in simulated]}


def table(results: Sequence[Record]) -> str:
    """Counts, and every reading that is worse."""
    found = [each for record in results for each in readings(record)]
    silent = sum(not any(True for _ in readings(record)) for record in results)
    worse = sorted((each for each in found if each.worse), key=lambda each: -each.standard_errors)
    text = (
        f"{len(worse)} of {len(found)} readings are worse by more than {WORSE:g} standard errors "
        f"({sum(each.standard_errors != 0 for each in found)} changed). "
        f"{silent} of {len(results)} results have no errors of readings.\n"
    )
    rows = [
        (
            each.case,
            each.quantity,
            f"{each.before:.3g} → {each.after:.3g} {each.unit}",
            f"{each.standard_errors:.1f}",
            "" if each.corrected is None else f"{each.corrected:.3g} {each.unit}",
        )
        for each in worse
    ]
    head = ("finger", "error", "before → after", "change, standard errors", "after, references as corrected")
    return f"{text}\n{markdown_table(head, rows)}" if rows else text


def main(arguments: list[str] | None = None) -> dict[str, list[Reading]]:
    """Print the table of each file, and return its readings."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="results of a study, a line a finger")
    given = parser.parse_args(arguments)
    out = {}
    for path in given.files:
        everything = kept_lines(path)
        if not everything:
            parser.exit(2, f"{parser.prog}: {path} has no results\n")
        results = [as_case(each) for each in newest(everything)]
        others = sum(version_of(each) != version_of(results[0]) for each in everything)
        print(f"{path}: version {version_of(results[0])}, {others} results of other versions left out\n")
        print(table(results))
        out[str(path)] = [each for record in results for each in readings(record)]
    return out


if __name__ == "__main__":
    main()
