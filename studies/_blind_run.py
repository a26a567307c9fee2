"""What `blind_study` does with one finger, and how it knows that the code is the one that was frozen."""

from __future__ import annotations

import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from independent.finger import Recording

ROOT = Path(__file__).parents[1]
#: What counts results.
COUNTING = ("studies/_blind_tables.py", "studies/_cause_rules.py", "studies/_page.py")
#: What makes results, and what counts them: the code that is examined, the simulator, and the study itself.
FROZEN = (
    *("bayestouch", "tests/independent"),
    *("studies/blind_study.py", "studies/_blind_pairs.py", "studies/_blind_run.py"),
    *("studies/_error_rate_versions.py", "studies/_shared_out.py", "studies/_result_lines.py"),
    *COUNTING,
)
#: Draws of each calibration, and of each touch of the exam: means of touches need no more.
CALIBRATION_DRAWS, TOUCH_DRAWS = 64, 256


class FrozenError(RuntimeError):
    """The code is not the one that was frozen, or was not frozen yet."""


def frozen_commit(tag: str, paths: tuple[str, ...] = FROZEN, root: Path = ROOT) -> str:
    """Hash of the commit that the tag names, if the files of the working tree are those of this commit.

    Raises
    ------
    FrozenError
        There is no such tag, or a file differs from it, or is new.
    """

    def git(*arguments: str) -> str:
        done = subprocess.run(["git", *arguments], cwd=root, capture_output=True, text=True, check=False)
        if done.returncode:
            raise FrozenError(f"no frozen code: git {' '.join(arguments)}: {done.stderr.strip()}")
        return done.stdout.strip()

    commit = git("rev-parse", "--verify", f"refs/tags/{tag}^{{commit}}")
    changed = git("diff", "--name-only", commit, "--", *paths).splitlines()
    changed += git("ls-files", "--others", "--exclude-standard", "--", *paths).splitlines()
    if changed:
        raise FrozenError(f"the code is not that of the tag {tag}: {', '.join(changed[:5])}")
    return commit


def require_own_package(root: Path = ROOT) -> None:
    """Raise `FrozenError` if the package that is imported is not the one of this checkout."""
    import bayestouch

    imported = Path(bayestouch.__file__ or "").resolve()
    if not imported.is_relative_to(root.resolve()):
        raise FrozenError(f"bayestouch is imported from {imported.parent}, which is not in {root.resolve()}")


def diagnosed(folder: Path, recording: Recording) -> dict[str, Any]:
    """What a diagnosis says of a data set, and what it does to the touches of the exam beside it.

    An error while the exam is read is recorded beside the diagnosis, which counts all the same.
    """
    import bayestouch

    diagnosis = bayestouch.diagnose(bayestouch.load_dataset(folder), draws=CALIBRATION_DRAWS, seed=0)
    numbers = diagnosis.numbers
    parts = ("before", "after", "after_against_stated")
    said = {
        "verdict": numbers["verdict"],
        "effects_found": [
            {"name": each["name"], "indistinguishable_from": list(each.get("indistinguishable_from", ()))}
            for each in numbers["effects"]
        ],
        "not_distinguishable": numbers["not_distinguishable"],
        "in_place": numbers["in_place"],
        "causes": numbers["causes"],
        **{part: scalars(numbers.get(part) or {}) for part in parts},
    }
    try:
        before, after = diagnosis.calibration_before, diagnosis.calibration_after
        return {**said, "exam": exam(folder / "exam.csv", recording, before, after)}
    except Exception as error:  # a study of many runs counts failures, it does not stop at one
        return {**said, "exam_error": named(error, folder)}


def named(error: Exception, folder: Path) -> str:
    """Kind and message of an error in one line, without the folder of the data."""
    return " ".join(f"{type(error).__name__}: {error}".replace(f"{folder.parent}/", "").split())


def scalars(part: Mapping[str, Any]) -> dict[str, float | None]:
    """Numbers alone."""
    return {key: value for key, value in part.items() if value is None or isinstance(value, (int, float))}


def exam(table: Path, recording: Recording, before: Any, after: Any) -> dict[str, dict[str, float]]:
    """Errors of R (mm), θ_c (degree) and P (N/m) against what is true, read with both calibrations."""
    import bayestouch

    first = sum(recording.parts[:2])
    tip, place = recording.tip[first:], recording.commanded[first:]
    true = {
        "R": 1 / (1 / recording.finger.body.outer + 1 / tip),
        "theta_c": recording.press.angle[first:],
        "P": recording.press.load[first:],
    }
    errors: dict[str, list[np.ndarray]] = {name: [] for name in true}
    for calibration in (before, after):
        for names, use_load in ((("R", "theta_c"), True), (("P",), False)):
            read = bayestouch.infer(
                table, calibration, use_load=use_load, method="importance", draws=TOUCH_DRAWS, workers=1
            )
            for name in names:
                errors[name].append(read.mean(name) - true[name])
    return {name: compared(*pair, place) for name, pair in errors.items()}


def compared(before: np.ndarray, after: np.ndarray, place: np.ndarray) -> dict[str, float]:
    """Root mean squares of errors before and after, and the mean change of their squares with its standard error.

    The standard error is that of the mean over places, each with the mean of its touches.
    """
    change = after**2 - before**2
    by_place = np.array([change[place == each].mean() for each in np.unique(place)])
    return {
        "before": float(np.sqrt(np.mean(before**2))),
        "after": float(np.sqrt(np.mean(after**2))),
        "change": float(by_place.mean()),
        "standard_error": float(by_place.std(ddof=1) / np.sqrt(len(by_place))),
    }
