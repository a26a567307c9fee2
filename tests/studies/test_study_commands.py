"""Every study as its page says to run it, ``python studies/NAME.py FOLDER``: small, and with files in the folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from study_modules import SCRIPTS, STUDIES

SHARED = Path(os.environ.get("BAYESTOUCH_SHARED", STUDIES.parents[1] / "shared"))

#: Within some three seconds of processor time; the others are slow tests.
QUICK = tuple(
    f"nicolson_fearing/{name}" for name in ["noise_row", "figure_2", "figure_3", "figure_6", "figure_9", "figure_10"]
)
#: Print alone, or write files that their options name.
NO_FOLDER = {
    *("conditions", "coverage", "faulty_pads", "faulty_sensors", "fuzz_coverage", "fuzz_readers", "gallery"),
    *("interruptions", "mutants", "sbc_power", "coverage_of_effects", "coverage_of_places", "from_finger_to_finger"),
    *("next_touches", "touch_uncertainty"),
}
#: Options in place of ``FOLDER --small``; without a folder they take the one after ``-o``.
OTHER_OPTIONS = {
    "blind_study": ("-o", "{folder}", "--development", "--processes", "1", "--cases", "1"),
    "causes": ("-o", "{folder}/lines.jsonl", "--development", "--fingers", "3", "--cases", "3"),
    "effects_gallery": ("{folder}",),
    "error_rates": ("-o", "{folder}", "--small", "--light", "--fingers", "1", "--processes", "1", "--minutes", "0.02"),
    "first_reports": ("{folder}",),
    "golden": ("-o", "{folder}", "--only", "pad_line"),
    "live_stream": ("-o", "{folder}", "--touches", "20"),
    "places_and_times": ("-o", "{folder}/lines.jsonl", "--only", "time", "--cases", "1"),
    "practice_diagnosis": ("-o", "{folder}", "finger-b"),
}
#: What they need of the folder of measured and practice data.
DATA = {
    "empirical_calibration": "practice",
    "measured_diagnosis": "measured",
    "measured_pads": "measured",
    "practice_diagnosis": "practice",
    "sweet_spots_measured": "measured",
}
NAMES = [name for name in SCRIPTS if name not in NO_FOLDER]


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in NAMES]
)
def test_a_study_runs_with_a_folder(name: str, tmp_path: Path) -> None:
    if name in DATA and not (SHARED / DATA[name]).is_dir():
        pytest.skip(f"the folder of {DATA[name]} data is absent")
    options = [option.format(folder=tmp_path) for option in OTHER_OPTIONS.get(name, ("{folder}", "--small"))]
    command = [sys.executable, str(STUDIES / f"{name}.py"), *options]
    environment = {**os.environ, "PYTHONPATH": str(STUDIES.parent), "BAYESTOUCH_SHARED": str(SHARED)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=1800, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout
    written = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert written and all(path.stat().st_size > 100 for path in written)


def test_studies_without_a_folder_do_not_take_one() -> None:
    """One that is given a folder one day is to be run with it."""
    for name in NO_FOLDER:
        source = (STUDIES / f"{name}.py").read_text("utf-8")
        assert not re.search(r'\boptions\(__doc__|add_argument\("folder"|"--output"', source), name
