"""Every study as its page says to run it, ``python studies/NAME.py FOLDER``: small, and with files in the folder.

Of a study whose function `main` another test runs, with a folder, only the command line is tried here.
"""

from __future__ import annotations

import os
import re
import runpy
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
#: `main` is run by another test of this folder, which looks at its numbers and files.
RUN_ELSEWHERE = {
    *("before_and_after", "blind_study", "design_questions", "error_rates", "first_reports", "live_stream"),
    *("measured_diagnosis", "other_pads", "pooling", "sbc_calibration", "sbc_touches", "sweet_spots_measured"),
    *(f"nicolson_fearing/table_{name}" for name in ("1", "2", "3", "4", "3_diagnosis", "3_modulus", "3_residual")),
    *(f"nicolson_fearing/figure_{name}" for name in ("4", "12", "13")),
    *(f"nicolson_fearing/{name}" for name in ("compare_published", "ridge", "sweet_spots", "sweet_spots_of_places")),
    *(f"nicolson_fearing/{name}" for name in ("place_mixtures", "table_3_widths")),
}
#: Print alone, or write files that their options name.
NO_FOLDER = {
    *("conditions", "coverage_of_touches", "faulty_pads", "faulty_sensors", "fuzz_coverage", "fuzz_readers", "gallery"),
    *("interruptions", "mutants", "sbc_power", "coverage_of_effects", "coverage_of_places", "from_finger_to_finger"),
    *("coverage_of_pads", "harm", "imitations", "import_graph", "naming_rules", "next_touches", "touch_uncertainty"),
}
#: Options in place of ``FOLDER --small``; without a folder they take the one after ``-o``.
OTHER_OPTIONS = {
    "causes": ("-o", "{folder}/lines.jsonl", "--development", "--fingers", "3", "--cases", "2"),
    "causes_of_forms": ("-o", "{folder}/lines.jsonl", "--cases", "2"),
    "effects_gallery": ("{folder}",),
    "golden": ("-o", "{folder}", "--only", "pad_three"),
    "places_and_times": ("-o", "{folder}/lines.jsonl", "--only", "time", "--cases", "1"),
    "practice_diagnosis": ("-o", "{folder}", "finger-a"),
}
#: What they need of the folder of measured and practice data.
DATA = {
    "empirical_calibration": "practice",
    "measured_pads": "measured",
    "practice_diagnosis": "practice",
}
NAMES = [name for name in SCRIPTS if name not in NO_FOLDER | RUN_ELSEWHERE]


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


@pytest.mark.parametrize("name", sorted(RUN_ELSEWHERE))
def test_a_study_that_another_test_runs_has_a_command(
    name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    tests = "".join(path.read_text("utf-8") for path in Path(__file__).parent.glob("test_*.py"))
    assert f'study("{name}")' in tests
    monkeypatch.setattr(sys, "argv", [f"{name}.py", "--help"])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(STUDIES / f"{name}.py"), run_name="__main__")
    assert ended.value.code == 0
    assert "usage:" in capsys.readouterr().out


def test_studies_without_a_folder_do_not_take_one() -> None:
    """One that is given a folder one day is to be run with it."""
    for name in NO_FOLDER:
        source = (STUDIES / f"{name}.py").read_text("utf-8")
        assert not re.search(r'\boptions\(__doc__|add_argument\("folder"|"--output"', source), name
