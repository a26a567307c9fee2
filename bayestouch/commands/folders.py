"""What a folder holds that the commands work on, and the next sensible step in it."""

from __future__ import annotations

import json
import shlex
from dataclasses import dataclass
from pathlib import Path

from bayestouch.errors import few

# A larger folder is no workplace of this package; the rest of its files is not looked at.
_MOST_FILES = 1000
# Names of touch tables in a data set, and so many bytes of another table are looked at.
_TABLES, _HEAD = ("touches.csv", "touches.parquet"), 65536

_YOURS = "type the path of your table in place of touches.csv"


@dataclass(frozen=True)
class Workplace:
    """What lies in a folder, as paths to type there; the newest of each kind first.

    Attributes
    ----------
    datasets : tuple of str
        Folders with a sensor.toml, ``.`` the folder itself.
    tables : tuple of str
        Touch tables beside no sensor.toml, of any name if they are in CSV.
    calibrations, posteriors : tuple of str
        Files that `calibrate` and `infer` wrote.
    diagnoses, reports : tuple of str
        Folders that `diagnose` and `report` wrote, ``.`` the folder itself.
    """

    datasets: tuple[str, ...]
    tables: tuple[str, ...]
    calibrations: tuple[str, ...]
    posteriors: tuple[str, ...]
    diagnoses: tuple[str, ...]
    reports: tuple[str, ...]


def workplace(folder: Path) -> Workplace:
    """Return what a folder holds; of the folders in it only what they are."""
    try:
        inside = sorted(folder.iterdir(), key=_age)[:_MOST_FILES]
    except OSError:
        inside = []
    names: dict[str, list[str]] = {"calibration": [], "touches": []}
    for file in inside:
        kind = _kind(file) if file.suffix == ".nc" else ""
        names.get(kind, []).append(file.name)

    def folders_with(marker: str) -> tuple[str, ...]:
        here = (".",) if _is_file(folder / marker) else ()
        return here + tuple(each.name for each in inside if _is_file(each / marker))

    tables = [each.name for each in inside if each.name in _TABLES or (each.suffix == ".csv" and _is_table(each))]
    tables.sort(key=lambda name: name not in _TABLES)
    return Workplace(
        datasets=folders_with("sensor.toml"),
        tables=() if _is_file(folder / "sensor.toml") else tuple(tables),
        calibrations=tuple(names["calibration"]),
        posteriors=tuple(names["touches"]),
        diagnoses=folders_with("diagnosis.json"),
        reports=folders_with("report.json"),
    )


def _age(file: Path) -> tuple[float, str]:
    try:
        return -file.stat().st_mtime, file.name
    except OSError:
        return 0.0, file.name


def _is_file(file: Path) -> bool:
    """True for a file; False too where the system does not let us look (folder of somebody else, name too long)."""
    try:
        return file.is_file()
    except OSError:
        return False


def _is_table(file: Path) -> bool:
    """True if the first line of a file has the columns that every touch table has."""
    names = {name.strip().strip('"') for name in _begin(file).partition("\n")[0].split(",")}
    return {"touch", "e01"} <= names


def _begin(file: Path) -> str:
    """Beginning of a text file; empty if it cannot be read."""
    try:
        with file.open("rb") as opened:
            return opened.read(_HEAD).decode("utf-8-sig", "replace")
    except OSError:
        return ""


def _without_touches(folder: Path) -> bool:
    """True for a data set that was started, and whose tables have a header alone."""
    begun = [_begin(folder / name) for name in ("touches.csv", "calibration.csv") if _is_file(folder / name)]
    return bool(begun) and not any(text.strip().count("\n") for text in begun)


def _kind(file: Path) -> str:
    """Return what a posterior file holds, ``calibration`` or ``touches``; empty if it is no such file."""
    import h5py  # type: ignore[import-untyped, unused-ignore]  # stubs are in newer ones only

    try:
        with h5py.File(file, "r") as root:
            kind = root.attrs.get("bayestouch", "")
    # The HDF5 library raises exceptions of any kind for a damaged file.
    except Exception:
        return ""
    return kind.decode() if isinstance(kind, bytes) else str(kind)


@dataclass(frozen=True)
class NextStep:
    """The next step in a folder.

    Attributes
    ----------
    found : str
        What was found, a sentence.
    commands : tuple of (str, str)
        Commands to type, with what they do; the first is the next step.
    """

    found: str
    commands: tuple[tuple[str, str], ...]


def next_step_in(folder: Path) -> NextStep:
    """Return what a folder holds, and the commands that come next."""
    here = workplace(folder)
    if here.reports[:1] == (".",):
        return _report(here)
    if here.diagnoses[:1] == (".",):
        return _diagnosis(folder)
    if here.datasets:
        return _dataset(folder, here)
    if here.calibrations:
        return _calibration(here)
    if here.posteriors:
        return _posterior(here)
    if here.tables:
        return _table(here)
    return NextStep(
        "This folder holds no data set, calibration or posterior.",
        (
            (_command("init", "my-finger"), "start a data set: a template to fill in"),
            (_command("example", "fluid-oil-1.5", "-o", "channel"), "or take a measured one, to try the commands"),
            (_command("report", "-o", "report", "--open"), "or see a report on simulated touches first"),
        ),
    )


def _table(here: Workplace) -> NextStep:
    """A table of touches alone: nothing says which sensor made it."""
    step = f"describe the sensor in my-finger/sensor.toml; then {here.tables[0]} takes the place of its touches.csv"
    return NextStep(
        f"Table of touches: {_listed(here.tables)}. No sensor.toml says which sensor it is of.",
        (
            (_command("init", "my-finger"), step),
            (_command("init", "my-pad", "--body", "pad"), "or the same for a pad"),
        ),
    )


def _dataset(folder: Path, here: Workplace) -> NextStep:
    """A data set, and what has been made of it so far; of several the newest."""
    data = here.datasets[0]
    found = f"Data set: {_listed(here.datasets)}."
    if _without_touches(folder / data):
        files = "sensor.toml, calibration.csv and touches.csv"
        return NextStep(
            f"Data set: {_listed((data,))}, without touches yet. Fill in {files}.",
            ((_command("check", data), "then look at what was read and what is missing"),),
        )
    report = _command("report", data, "-o", "report", "--open")
    saved = ("--diagnosis", here.diagnoses[0]) if here.diagnoses else ()
    if here.diagnoses:
        report = _command("report", data, *saved, "-o", "report", "--open")
    table = "touches.csv" if data == "." else f"{data}/touches.csv"
    if not (here.calibrations or here.diagnoses or here.reports):
        return NextStep(
            found,
            (
                (_command("check", data), "look at what was read and what is missing"),
                (report, "then all steps at once: calibrate, read the touches, diagnose, write a page"),
                (_command("calibrate", data, "-o", "calibration.nc"), "or the first step alone"),
            ),
        )
    if here.calibrations and not here.posteriors:
        calibration = here.calibrations[0]
        return NextStep(
            f"{found} Calibration: {_listed(here.calibrations)}.",
            (
                (
                    _command("infer", table, "--calibration", calibration, "-o", "posterior.nc"),
                    "read the touches with this calibration",
                ),
            ),
        )
    if not here.diagnoses and not here.reports:
        return NextStep(
            f"{found} Calibration: {_listed(here.calibrations)}. Posterior: {_listed(here.posteriors)}.",
            (
                (_command("diagnose", data, "-o", "diagnosis"), "find what the model of the sensor lacks"),
                (report, "or write a report on everything"),
            ),
        )
    if not here.reports:
        return NextStep(f"{found} Diagnosis: {_listed(here.diagnoses)}.", ((report, "write a report with it"),))
    found = f"{found} Report: {_listed(here.reports)}; open {here.reports[0]}/index.html in a browser."
    again = (report, "or write the report again, if the data have changed")
    if not here.diagnoses:
        find = _command("diagnose", data, "-o", "diagnosis")
        return NextStep(found, ((find, "find what the model of the sensor lacks, with errors before and after"), again))
    after = f"{here.diagnoses[0]}/calibration_after.nc"
    read = _command("infer", table, "--calibration", after, "-o", "posterior.nc")
    return NextStep(
        f"{found} Diagnosis: {_listed(here.diagnoses)}.", ((read, "read the touches with what was found"), again)
    )


def _calibration(here: Workplace) -> NextStep:
    found, table = f"Calibration: {_listed(here.calibrations)}.", here.tables[0] if here.tables else "touches.csv"
    new = "posterior.nc" if "posterior.nc" not in here.posteriors else "posterior-of-new-touches.nc"
    command = _command("infer", table, "--calibration", here.calibrations[0], "-o", new)
    read = (command, "read a table of touches with it" if here.tables else f"read a table of touches with it; {_YOURS}")
    if not here.posteriors:
        return NextStep(found, (read,))
    shown = _posterior(here)
    return NextStep(f"{found} {shown.found}", (read, *shown.commands))


def _posterior(here: Workplace) -> NextStep:
    code = f"import bayestouch; print(bayestouch.load({here.posteriors[0]!r}).summary())"
    command = f"python -c {shlex.quote(code)}"
    return NextStep(f"Posterior: {_listed(here.posteriors)}.", ((command, "one row for each touch, in Python"),))


def _diagnosis(folder: Path) -> NextStep:
    """A diagnosis: its verdict, and reading touches with the model that it found."""
    after = "calibration_after.nc"
    command = _command("infer", "touches.csv", "--calibration", after, "-o", "posterior.nc")
    return NextStep(
        f"Diagnosis{_verdict(folder)}.", ((command, f"read a table of touches with what was found; {_YOURS}"),)
    )


def _verdict(folder: Path) -> str:
    try:
        numbers = json.loads((folder / "diagnosis.json").read_text("utf-8"))
        names = [str(each["name"]) for each in numbers["effects"]]
        return f": {numbers['verdict']}, effects found: {few(names) or 'none'}"
    except (OSError, ValueError, KeyError, TypeError):
        return ""


def _report(here: Workplace) -> NextStep:
    calibration = "calibration.nc" if "calibration.nc" in here.calibrations else ""
    commands: tuple[tuple[str, str], ...] = ()
    if calibration:
        command = _command("infer", "touches.csv", "--calibration", calibration, "-o", "posterior-of-new-touches.nc")
        commands = ((command, f"read other touches with its calibration; {_YOURS}"),)
    return NextStep("Report: open index.html in a browser.", commands)


def _listed(names: tuple[str, ...]) -> str:
    return few(["this folder" if name == "." else name for name in names], 4)


def _command(*words: str) -> str:
    return shlex.join(("bayestouch", *words))
