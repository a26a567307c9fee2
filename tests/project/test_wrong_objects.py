"""An argument of another kind is refused in a line that says how to get the right one."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import emcee
import pytest
from report_cases import FINGER

import bayestouch
from bayestouch.priors.parameters import LogNormal, LogStudentT, Normal, StudentT, Uniform

NO_DATA_SET = {
    "calibrate": bayestouch.calibrate,
    "check": bayestouch.check,
    "diagnose": bayestouch.diagnose,
    "save_dataset": lambda dataset: bayestouch.save_dataset(dataset, "folder"),
    "report": lambda dataset: bayestouch.report(dataset, "report"),
}


@pytest.fixture(scope="module")
def simulated() -> bayestouch.SimulatedDataSet:
    return bayestouch.simulate(FINGER, seed=3)


@pytest.fixture(scope="module")
def calibration(simulated: bayestouch.SimulatedDataSet) -> bayestouch.Calibration:
    return bayestouch.calibrate(simulated.dataset, draws=100, discrepancy="touch")


@pytest.mark.parametrize("verb", NO_DATA_SET)
def test_what_is_no_data_set(verb: str, simulated: bayestouch.SimulatedDataSet) -> None:
    call: Callable[[Any], object] = NO_DATA_SET[verb]
    for given, message in (
        ("my-finger", "got 'my-finger'; read it: bayestouch.load_dataset('my-finger')"),
        (simulated, "got SimulatedDataSet; use its attribute dataset"),
        (simulated.dataset.touches, "got Touches; read one: bayestouch.load_dataset(folder)"),
    ):
        with pytest.raises(bayestouch.InputError, match=f"^{re.escape(f'expected a data set, {message}')}$"):
            call(given)


def test_what_is_no_calibration(simulated: bayestouch.SimulatedDataSet, calibration: bayestouch.Calibration) -> None:
    touches: Any = simulated.dataset.touches
    with pytest.raises(bayestouch.InputError, match=r"^expected a calibration, got 'c.nc'; read it: .*load\('c.nc'\)$"):
        bayestouch.infer(touches, "c.nc")  # type: ignore[arg-type]
    with pytest.raises(bayestouch.InputError, match=r"^expected a calibration, got DataSet; make one: "):
        bayestouch.candidate_touches(simulated.dataset)  # type: ignore[arg-type]
    with pytest.raises(bayestouch.InputError, match=r"^expected a calibration, got Touches; make one: "):
        bayestouch.infer(calibration, touches)  # type: ignore[arg-type]
    with pytest.raises(bayestouch.InputError, match=r"^expected touches, got DataSet; use its attribute touches$"):
        bayestouch.infer(simulated.dataset, calibration)  # type: ignore[arg-type]
    with pytest.raises(bayestouch.InputError, match=r"^expected a data set, got Touches; "):
        bayestouch.log_density(calibration, touches)


@pytest.mark.parametrize("workers", ["a", 0, -1, 1.5])
def test_what_is_no_number_of_workers(
    simulated: bayestouch.SimulatedDataSet, calibration: bayestouch.Calibration, workers: Any, tmp_path: Path
) -> None:
    message = f"^workers: expected a whole number, at least 1, got {workers!r}$"
    for output in (None, tmp_path / "posterior.nc"):
        with pytest.raises(bayestouch.InputError, match=message):
            bayestouch.infer(simulated.dataset.touches, calibration, draws=64, workers=workers, output=output)


@pytest.mark.parametrize("moves", [3, [], [3], emcee.moves.StretchMove, [(3, 1.0)]])
def test_what_are_no_moves_of_emcee(simulated: bayestouch.SimulatedDataSet, moves: object) -> None:
    with pytest.raises(bayestouch.InputError, match=r"^moves: expected a move of emcee, such as "):
        bayestouch.calibrate(simulated.dataset, moves=moves)


def test_what_is_no_parameter(simulated: bayestouch.SimulatedDataSet, calibration: bayestouch.Calibration) -> None:
    posteriors = bayestouch.infer(simulated.dataset.touches, calibration, draws=64)
    for call in (posteriors.mean, posteriors.sd, posteriors.interval):
        with pytest.raises(
            bayestouch.InputError, match=r"^theta: no such parameter; expected one of .*R.*; did you mean theta_c\?$"
        ):
            call("theta")
    with pytest.raises(bayestouch.InputError, match=r"^probability: expected a number between 0 and 1, got 90$"):
        posteriors.interval("R", 90)
    kept = bayestouch.infer(simulated.dataset.touches, calibration, draws=64, summary_only=True)
    assert len(kept.interval("R")) == 2
    with pytest.raises(
        bayestouch.InputError, match=r"^probability: only summaries were kept, expected 0\.9, got 0\.5$"
    ):
        kept.interval("R", 0.5)


def test_other_slips_in_a_notebook(simulated: bayestouch.SimulatedDataSet, calibration: bayestouch.Calibration) -> None:
    data, given = simulated.dataset, calibration
    frame: Any = data.to_dataframe()
    read: Any = bayestouch.infer(data.touches.select(data.touches.touch == data.touches.touch[0]), given, draws=64)
    wrong: dict[str, Callable[[], object]] = {
        "expected touches, got DataFrame": lambda: bayestouch.infer(frame, given),
        "touches: expected touches, got DataFrame": lambda: bayestouch.DataSet(data.sensor, None, frame),
        "groups: expected all, or some of": lambda: bayestouch.infer(data.touches, given, groups=None),  # type: ignore[arg-type]
        "groups: expected all": lambda: bayestouch.infer(data.touches, given, groups=[1]),  # type: ignore[list-item]
        "plug_in: expected True or False, got 'no'": lambda: bayestouch.Reader(given, plug_in="no"),  # type: ignore[arg-type]
        "expected a calibration, its path, or a list": lambda: bayestouch.calibrate(data, like=3),  # type: ignore[arg-type]
        "expected the path of a posterior file, got NoneType": lambda: bayestouch.load(None),  # type: ignore[arg-type]
        "3: no such parameter": lambda: read.mean(3),
        "probability: expected a number, got [0.5, 0.9]": lambda: read.interval("R", [0.5, 0.9]),
        "touch: expected a list of numbers, got 'a'": lambda: read.sel(touch="a"),
    }
    for message, call in wrong.items():
        with pytest.raises(bayestouch.InputError, match=f"^{re.escape(message)}"):
            call()


@pytest.mark.parametrize("progress", [3, "a"])
def test_what_is_no_function_of_the_fraction(
    simulated: bayestouch.SimulatedDataSet, calibration: bayestouch.Calibration, progress: Any, tmp_path: Path
) -> None:
    data, message = simulated.dataset, f"^progress: expected a function of the fraction that is done, got {progress!r}$"
    calls: list[Callable[[], object]] = [
        lambda: bayestouch.calibrate(data, progress=progress),
        lambda: bayestouch.infer(data.touches, calibration, progress=progress),
        lambda: bayestouch.diagnose(data, progress=progress),
        lambda: bayestouch.report(data, tmp_path / "report", progress=progress),
        lambda: bayestouch.compare(data, data, tmp_path / "comparison", progress=progress),
        lambda: bayestouch.sbc(calibration, progress=progress),
    ]
    for call in calls:
        with pytest.raises(bayestouch.InputError, match=message):
            call()
    assert not any(tmp_path.iterdir())


def test_what_is_no_address_of_a_scheduler(
    simulated: bayestouch.SimulatedDataSet, calibration: bayestouch.Calibration
) -> None:
    data, address = simulated.dataset, 3
    calls: list[Callable[[], object]] = [
        lambda: bayestouch.infer(data.touches, calibration, scheduler=address),  # type: ignore[arg-type]
        lambda: bayestouch.diagnose(data, scheduler=address),  # type: ignore[arg-type]
        lambda: bayestouch.sbc(data, scheduler=address),  # type: ignore[arg-type]
    ]
    for call in calls:
        with pytest.raises(bayestouch.InputError, match=r"^scheduler: expected an address, such as 'tcp://.*, got 3$"):
            call()


def test_what_is_no_number_of_a_prior() -> None:
    a: Any = "a"
    wrong: dict[str, Callable[[], object]] = {
        "normal prior: mean: expected a number, got 'a'": lambda: Normal(a, 1.0),
        "normal prior: sd: expected a number, got None": lambda: Normal(1.0, None),  # type: ignore[arg-type]
        "normal prior: low: expected a number, got [1, 2]": lambda: Normal(1.0, 1.0, [1, 2]),  # type: ignore[arg-type]
        "uniform prior: high: expected a number, got 'a'": lambda: Uniform(0.0, a),
        "log-normal prior: median: expected a number, got 'a'": lambda: LogNormal(a, 1.0),
        "Student-t prior: dof: expected a number, got 'a'": lambda: StudentT(0.0, 1.0, a),
        "log-Student-t prior: spread: expected a number, got 'a'": lambda: LogStudentT(1.0, a, 4.0),
    }
    for message, call in wrong.items():
        with pytest.raises(bayestouch.InputError, match=f"^{re.escape(message)}$"):
            call()


def test_what_cannot_be_plotted(simulated: bayestouch.SimulatedDataSet, calibration: bayestouch.Calibration) -> None:
    data = simulated.dataset
    read: Any = bayestouch.infer(
        data.touches.select(data.touches.touch == data.touches.touch[0]), calibration, draws=64
    )
    known: Any = calibration
    two = "names: expected two parameters, such as ('theta_c', 'R'), got "
    wrong: dict[str, Callable[[], object]] = {
        "element: expected a whole number, at least 1, got 1.5": lambda: known.plot_fit(1.5),
        "element: expected a whole number, at least 1, got 'a'": lambda: known.plot_fit("a"),
        "3: no such parameter; expected one of ": lambda: known.plot_parameter(3),
        "['R']: no such parameter; expected one of ": lambda: read.plot_estimates(["R"]),
        f"{two}('R',)": lambda: read.plot_touch(0, ("R",)),
        f"{two}'Rx'": lambda: read.plot_touch(0, "Rx"),
        f"{two}3": lambda: read.plot_touch(0, 3),
        "4: no such parameter; expected one of ": lambda: read.plot_touch(0, ("R", 4)),
    }
    for message, call in wrong.items():
        with pytest.raises(bayestouch.InputError, match=f"^{re.escape(message)}"):
            call()


def test_what_are_no_points_of_a_density(
    simulated: bayestouch.SimulatedDataSet, calibration: bayestouch.Calibration
) -> None:
    density: Any = bayestouch.log_density(calibration, simulated.dataset)
    for call in (
        density,
        density.log_prior,
        density.log_likelihood,
        density.touch_log_likelihood,
        density.to_parameters,
    ):
        with pytest.raises(bayestouch.InputError, match=r"^points: expected a list of numbers, got 'a'$"):
            call("a")
    with pytest.raises(bayestouch.InputError, match=r"^expected parameters by name, got 'a'$"):
        density.from_parameters("a")
