"""Benchmarks run small, and their numbers."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from study_modules import STUDIES, study

import bayestouch
from bayestouch.data.touches import touches_from


def test_log_likelihood_benchmark_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cost is printed, and the table beats the series it replaces by far more than timing can blur."""
    module = study("benchmarks/log_likelihood")
    monkeypatch.setattr(module, "TOUCHES", 32)
    nanoseconds = module.main()
    assert nanoseconds["tabulated, calibration plugged in"] < nanoseconds["Fourier series"] / 5


def test_the_floor_of_a_log_likelihood_has_its_precision(monkeypatch: pytest.MonkeyPatch) -> None:
    """The table and residuals are float32; multiplications of float64 would take twice as long and be no bound."""
    module = study("benchmarks/log_likelihood")
    monkeypatch.setattr(module, "TOUCHES", 4)
    passes, out = module.floor(8)
    passes()
    x = np.broadcast_to([0.0, 0.0, 200.0], (4, 2, 3))
    assert out.dtype == module.posterior(False).residual(x, np.arange(4)).dtype == np.float32
    assert out.shape == (8, module.ELEMENTS) and (out > 0).all()


def test_contact_benchmark(capsys: pytest.CaptureFixture[str]) -> None:
    """Each way of solving the contact is timed, and shown as a multiple of Hertz."""
    seconds = study("benchmarks/contact").main()
    lines = capsys.readouterr().out.splitlines()[1:]
    assert len(lines) == len(seconds) == 3
    for line, value in zip(lines, seconds.values(), strict=True):
        assert float(line.split()[-3]) == pytest.approx(value / seconds["Hertz"], abs=0.006)


def test_many_touches_benchmark_meets_its_demands(capsys: pytest.CaptureFixture[str]) -> None:
    """Every touch reaches the effective sample size that the benchmark claims."""
    study("benchmarks/many_touches").main(64)
    lines = [line for line in capsys.readouterr().out.splitlines() if "least ESS" in line]
    assert len(lines) == 4
    assert all(float(line.split("least ESS")[1].split()[0]) >= 400 for line in lines)


def test_plain_emcee_is_compared_by_processor_time(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Plain emcee takes 3 s of one core for each of 64 touches, the others 2 s on two cores: 4 s of processor."""
    module = study("benchmarks/many_touches")
    drawn = {"ess_bulk": np.full((64, 3), 400.0), "grade": np.ones(64), "round": np.zeros(64)}
    monkeypatch.setattr(module, "plain_emcee", lambda sampler, touches: 3.0)
    monkeypatch.setattr(module, "timed", lambda sampler, touches, plan: (2.0, 4.0, drawn))
    module.main(64)
    lines = [line for line in capsys.readouterr().out.splitlines() if "x plain" in line]
    assert len(lines) == 4
    assert all(line.split("x plain")[0].split()[-1] == "48" for line in lines)


def test_calibrations_of_fingers_have_enough_draws() -> None:
    """The row says what the calibration does."""
    design = bayestouch.FingerDesign(n_elements=4, edge_step_deg=4.0, flat_step_deg=8.0)
    (row,) = study("benchmarks/finger_calibrations").main(("cross-talk",), design)
    assert row[0] == "cross-talk" and 0 < float(row[1]) <= 1
    assert float(row[2]) >= 400 and float(row[3]) <= 1.02


@pytest.mark.parametrize("name", ["finger_calibrations", "pad_calibrations"])
def test_calibrations_count_the_processes_that_they_fork(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """1 and 2 s of this process, 3 and 4 s of those that it started: 10 s."""
    module = study(f"benchmarks/{name}")
    monkeypatch.setattr(os, "times", lambda: (1.0, 2.0, 3.0, 4.0, 99.0))
    assert module.processor_seconds() == 10.0


def test_the_row_of_a_calibration_has_its_processor_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    module = study("benchmarks/finger_calibrations")
    found = SimpleNamespace(statistics={"acceptance": 0.8, "ess_bulk": 500.0, "rhat": 1.01})
    monkeypatch.setattr(bayestouch, "calibrate", lambda *_, **__: found)
    clock = iter([1.0, 13.3])
    monkeypatch.setattr(module, "processor_seconds", lambda: next(clock))
    design = bayestouch.FingerDesign(n_elements=2, edge_step_deg=8.0, flat_step_deg=16.0)
    assert module.row("no effect", design) == ["no effect", "0.80", "500", "1.010", "12.3 s"]


def test_a_diagnosis_is_timed_on_all_its_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    """1.5 s of this process and 2.5 s of those that it started: 4 s, whatever the clock says."""
    module = study("benchmarks/diagnosis")
    clock = iter([(1.0, 0.0, 0.0, 0.0, 50.0), (2.0, 0.5, 2.0, 0.5, 52.0)])
    monkeypatch.setattr(os, "times", lambda: next(clock))
    assert module.timed(lambda: "result") == ("result", 4.0)


def test_sizes_of_the_tables_that_scale() -> None:
    """Those of the page, and fewer where the largest is smaller."""
    module = study("benchmarks/scaling")
    assert module.sizes_up_to(module.LARGEST) == (1000, 10_000, 100_000, 400_000, 1_000_000)
    assert module.sizes_up_to(20_000) == (1000, 10_000, 20_000)
    page = (STUDIES.parent / "docs" / "large.md").read_text("utf-8")
    table = page.partition("| touches | s | s of processor | peak MB |")[2].partition("\n\n")[0]
    first = [line.split("|")[1].strip().replace(",", "") for line in table.splitlines()[2:]]
    assert [int(each) for each in first] == list(module.sizes_up_to(module.LARGEST))


def test_the_overhead_of_a_cluster_is_given_with_the_distance_of_the_runs() -> None:
    """4 s once and 20 ms a block, and runs of 10, 20 and 30 blocks off by 0.1, -0.2 and 0.1 s."""
    line = study("benchmarks/cluster").Line
    found = line.through(np.array([10.0, 20.0, 30.0]), np.array([4.3, 4.2, 4.7]))
    assert (found.block, found.once, found.miss) == pytest.approx((0.02, 4.0, 0.2), rel=1e-9)


def test_versions_are_compared_on_as_many_touches_as_the_table_says() -> None:
    """All rows of the first two of three touches."""
    touches = touches_from(np.array([0, 0, 4, 7, 7]), np.ones((5, 2)))
    assert study("benchmarks/versions").first_touches(touches, 2).touch.tolist() == [0, 0, 4]
    assert study("benchmarks/versions").first_touches(touches, 9).touch.tolist() == [0, 0, 4, 7, 7]


def test_a_part_of_the_versions_is_not_written_as_the_table(tmp_path: Path) -> None:
    module = study("benchmarks/versions")
    done = CliRunner().invoke(module.main, [str(tmp_path), "--only", "report", "--docs"])
    assert done.exit_code == 2 and "leave out --only" in done.output


def test_an_environment_of_peers_that_was_interrupted_is_completed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """pip fails the first time, with Python already there; the second time it installs, the third nothing is run."""
    module = study("benchmarks/peers")
    (tmp_path / "bin").mkdir()
    (tmp_path / "bin" / "python").touch()
    run: list[str] = []

    def failing(command: list[str], **_: object) -> None:
        run.append(command[2])
        if run == ["venv", "pip"]:
            raise subprocess.CalledProcessError(1, command)

    monkeypatch.setattr(module.subprocess, "run", failing)
    with pytest.raises(subprocess.CalledProcessError):
        module.environment(tmp_path)
    assert module.environment(tmp_path) == module.environment(tmp_path) == tmp_path / "bin" / "python"
    assert run == ["venv", "pip", "venv", "pip"]


def test_libraries_read_the_same_file_and_are_timed_as_often(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """xarray behind the checks has the arrays of xarray alone; ours and ArviZ have the same number of runs."""
    module = study("benchmarks/libraries")
    design = bayestouch.FingerDesign(n_elements=2, edge_step_deg=8.0, flat_step_deg=16.0)
    path = tmp_path / "calibration.nc"
    bayestouch.calibrate(bayestouch.simulate(design, seed=1).dataset, draws=8).save(path)
    alone, behind = (module.READERS[name](path) for name in ("xarray", "xarray behind our checks"))
    assert set(alone) == set(behind) >= {"posterior"}
    assert all(alone[name].identical(behind[name]) for name in alone)
    repeated: list[int] = []
    monkeypatch.setattr(module, "seconds", lambda call, repeats: float(repeated.append(repeats) or 1.0))
    assert module.grades(2, 3)["difference"] < 1e-9
    assert repeated == [3, 3]


def test_derivatives_are_timed_both_ways(capsys: pytest.CaptureFixture[str]) -> None:
    """Each line has both times and their ratio."""
    ratios = study("benchmarks/derivatives").main(bayestouch.FingerDesign(n_elements=4, edge_step_deg=4.0))
    lines = capsys.readouterr().out.splitlines()[1:]
    for line, ratio in zip(lines, ratios.values(), strict=True):
        now, before = (float(part.split()[-1]) for part in line.split("ms")[:2])
        assert before / now == pytest.approx(ratio, rel=0.2) and ratio > 0


def test_reading_a_table_is_timed_beside_pandas(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    ratios = study("benchmarks/reading").main(1, 1)
    assert ratios["pandas.read_csv"] == 1 and min(ratios.values()) > 0
    assert "7,380 rows" in capsys.readouterr().out


@pytest.mark.slow
def test_interruptions() -> None:
    """Killed by a signal and with the disk full, a run loses nothing and ends with the same bytes."""
    found = study("interruptions").main(1, 0)
    assert found["SIGKILL"].injected == found["SIGTERM"].injected == found["disk full"].injected == 1
    assert all(tally.lost == 0 for tally in found.values())


@pytest.mark.slow
def test_scaling(capsys: pytest.CaptureFixture[str]) -> None:
    """A row for each table and the smallest; memory does not grow from a thousand touches to two."""
    found = study("benchmarks/scaling").main((1000, 2000))
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [row[0] for row in rows if len(row) == 7 and row[0].isdigit()] == ["64", "1000", "2000"]
    # how time grows is for the study to print: the clock of a machine that does other things decides no test
    assert found["memory"] < 0.3


@pytest.mark.slow
def test_cluster(capsys: pytest.CaptureFixture[str]) -> None:
    """Blocks of both sizes are read by one worker and by two."""
    pytest.importorskip("distributed", reason="distributed is not installed")
    found = study("benchmarks/cluster").main(512, 1, (128, 256))
    # what they took is for the study to print: no test is timed
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [row[0] for row in rows if len(row) == 6 and row[0].isdigit()] == ["128", "256"]
    assert found["speed-up"] > 0
