"""Files from strangers: nothing in them runs, is followed, or takes more memory than it is worth."""

from __future__ import annotations

import io
import json
import mmap
import re
import struct
import subprocess
import sys
import tokenize
from pathlib import Path

import h5py
import numpy as np
import pytest
from input_tables import GOOD, SENSOR, error, put
from posterior_cases import calibration

import bayestouch
from bayestouch.data.dataset import load_dataset
from bayestouch.errors import InputError
from bayestouch.reporting.diagnosed import saved_diagnosis
from bayestouch.reporting.diagnosis_file import read_diagnosis
from bayestouch.results import hdf5_heaps
from bayestouch.results.reading import load

PACKAGE = Path(bayestouch.__file__).parent


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    """A calibration file as `calibrate` writes it."""
    calibration().save(tmp_path / "calibration.nc")
    assert load(tmp_path / "calibration.nc").sensor.name == calibration().sensor.name
    return tmp_path / "calibration.nc"


def refused(path: Path) -> str:
    """The one line with which a file is refused."""
    with pytest.raises(InputError) as caught:
        load(path)
    assert "\n" not in str(caught.value) and str(caught.value).startswith(str(path))
    return str(caught.value)


def test_nothing_in_the_package_unpickles_or_evaluates() -> None:
    """What runs code on load is called nowhere, nor is the switch set that lets numpy do so.

    Except where a sensor goes to the workers of the user's own cluster: what they unpickle was made by the same command
    and lies in no file.
    """
    forbidden = {
        "pickle",
        "cPickle",
        "dill",
        "cloudpickle",
        "joblib",
        "shelve",
        "marshal",
        "eval",
        "exec",
        "read_pickle",
    }
    for file in sorted(PACKAGE.rglob("*.py")):
        source = file.read_text("utf-8")
        names = {
            token.string
            for token in tokenize.generate_tokens(io.StringIO(source).readline)
            if token.type == tokenize.NAME
        }
        if file.name == "cluster.py":
            names.remove("pickle")
        assert not names & forbidden, (file.name, names & forbidden)
        assert not re.search(r"allow_pickle\s*=\s*True", source), file.name
        for call in re.findall(r"np\.load\([^\n]*", source):
            assert "allow_pickle=False" in call, (file.name, call)


def test_links_of_a_posterior_file_are_not_followed(saved: Path) -> None:
    other = saved.with_name("secret.h5")
    with h5py.File(other, "w") as file:
        file["mu"] = np.zeros((4, 10))
    with h5py.File(saved, "a") as file:
        del file["posterior/mu"]
        file["posterior/mu"] = h5py.ExternalLink("secret.h5", "/mu")
    assert "holds a link" in refused(saved)


def test_a_link_to_itself_is_not_followed(saved: Path) -> None:
    with h5py.File(saved, "a") as file:
        file["posterior/again"] = h5py.SoftLink("/posterior")
    assert "holds a link" in refused(saved)


def test_arrays_kept_in_other_files_are_not_read(saved: Path) -> None:
    outside = saved.with_name("secret.bin")
    outside.write_bytes(bytes(320))
    with h5py.File(saved, "a") as file:
        file.create_dataset("posterior/outside", (40,), "f8", external=[(str(outside), 0, 320)])
    assert "kept in other files" in refused(saved)


def test_virtual_arrays_are_not_read(saved: Path) -> None:
    with h5py.File(saved.with_name("secret.h5"), "w") as file:
        file["mu"] = np.zeros(40)
    with h5py.File(saved, "a") as file:
        layout = h5py.VirtualLayout((40,), "f8")
        layout[:] = h5py.VirtualSource("secret.h5", "mu", (40,))
        file.create_virtual_dataset("posterior/virtual", layout)
    assert "kept in other files" in refused(saved)


def test_references_and_records_are_not_read(saved: Path) -> None:
    with h5py.File(saved, "a") as file:
        file.create_dataset("posterior/pointer", data=[file["posterior/mu"].ref], dtype=h5py.ref_dtype)
    assert "expected numbers or text" in refused(saved)


def test_more_attributes_than_ours_are_refused(saved: Path) -> None:
    with h5py.File(saved, "a") as file:
        for number in range(300):
            file.attrs[str(number)] = "x"
    assert "more than 256 attributes" in refused(saved)


def test_more_groups_than_ours_are_refused(saved: Path) -> None:
    with h5py.File(saved, "a") as file:
        for number in range(100):
            file.create_group(f"g{number}")
    assert "more than 64" in refused(saved)


@pytest.mark.parametrize("size", [0, 16, 2**64 - 16], ids=["none", "another behind it", "backwards"])
def test_a_heap_without_end_is_refused_and_not_walked(saved: Path, size: int) -> None:
    """In HDF5 2.0 this never comes back; a child reads it, so that a hang ends the test and nothing else."""
    data = bytearray(saved.read_bytes())
    heap = data.find(b"GCOL\x01")
    assert heap > 0, "the file has no heap: the test must make one"
    at, end = heap + 16, heap + int.from_bytes(data[heap + 8 : heap + 16], "little")
    while at < end and int.from_bytes(data[at : at + 2], "little"):
        at += 16 + (int.from_bytes(data[at + 8 : at + 16], "little") + 7) // 8 * 8
    assert at + 32 <= end, "the heap is full: no free space to damage"
    data[at + 8 : at + 32] = size.to_bytes(8, "little") + bytes(16)
    saved.write_bytes(data)
    code = f"from bayestouch.results.reading import load\nload({str(saved)!r})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert "a heap of texts has no end" in done.stderr


def test_a_heap_that_begins_at_the_end_of_a_window_is_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file is looked through a window at a time; two of the signature's five bytes lie in the first."""
    monkeypatch.setattr(hdf5_heaps, "_WINDOW", mmap.PAGESIZE)
    heap = b"GCOL\x01\0\0\0" + struct.pack("<QHHIQ", 4096, 0, 0, 0, 0)
    file = tmp_path / "damaged.nc"
    file.write_bytes((b"\0" * (mmap.PAGESIZE - 2) + heap).ljust(4 * mmap.PAGESIZE, b"\0"))
    with pytest.raises(InputError, match="a heap of texts has no end"):
        hdf5_heaps.check_heaps(file)


def test_an_attribute_that_declares_more_than_the_file_is_refused(saved: Path) -> None:
    """The length of a text is stated where its type is: nothing must be asked of the machine on its word."""
    size = 40_021
    kind = h5py.h5t.C_S1.copy()
    kind.set_size(size)
    with h5py.File(saved, "a") as file:
        h5py.h5a.create(file.id, b"large", kind, h5py.h5s.create(h5py.h5s.SCALAR))
    assert load(saved).sensor.name == calibration().sensor.name
    data = saved.read_bytes()
    stated = size.to_bytes(4, "little")
    assert stated in data
    saved.write_bytes(data.replace(stated, (1 << 30).to_bytes(4, "little")))
    refused(saved)


def _parquet(folder: Path, table: object) -> Path:
    pq = pytest.importorskip("pyarrow.parquet")
    (folder / "sensor.toml").write_text(SENSOR)
    pq.write_table(table, folder / "touches.parquet")
    return folder


def test_a_pickle_in_a_parquet_type_is_not_opened(tmp_path: Path) -> None:
    """pyarrow before 14.0.1 did (CVE-2023-47248): the type's description was a pickle, unpickled with the schema."""
    pa = pytest.importorskip("pyarrow")
    trace = tmp_path / "it ran"
    pickled = b"cos\nmkdir\n(V" + str(trace).encode() + b"\ntR."
    kind = {"ARROW:extension:name": "arrow.py_extension_type", "ARROW:extension:metadata": pickled}
    fields = [pa.field(name, pa.float64()) for name in ("touch", "x_mm", "e01", "e02")]
    fields.append(pa.field("other", pa.float64(), metadata=kind))
    path = _parquet(tmp_path, pa.table([pa.array([1.0, 2.0])] * 5, schema=pa.schema(fields)))
    try:
        assert load_dataset(path).touches.n_rows == 2
    except InputError as refusal:  # older versions name the type that they do not know
        assert "extension" in str(refusal)
    assert not trace.exists()
    import pickle

    pickle.loads(pickled)
    assert trace.exists()  # the pickle is a good one


def test_lists_in_the_cells_of_a_parquet_table_are_refused_unread(tmp_path: Path) -> None:
    pa = pytest.importorskip("pyarrow")
    columns = {name: [1.0, 2.0] for name in ("touch", "x_mm", "e01", "e02")}
    path = _parquet(tmp_path, pa.table(columns | {"other": [[0.0] * 100_000] * 2}))
    expected = "touches.parquet, column other: expected numbers or text, got list<"
    assert error(path).startswith(expected)


def test_a_parquet_table_far_larger_than_its_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pa = pytest.importorskip("pyarrow")
    ones = pa.array(np.ones(1_000_000))
    path = _parquet(tmp_path, pa.table({name: ones for name in ("touch", "x_mm", "e01", "e02")}))
    monkeypatch.setattr("bayestouch.data.parquet.FREE_BYTES", 0)
    assert error(path) == "touches.parquet: declares 1000000 rows of 4 columns, more than it can hold"


@pytest.mark.parametrize(
    "text",
    [
        "a" + ".a" * 10_000 + " = 1",
        "a = " + "[" * 100_000,
        "a = " + "{a=" * 100_000,
        "[" + "a." * 5_000 + "a]",
        "#" * 10**6,
    ],
    ids=["dotted key", "arrays", "inline tables", "heading", "a comment"],
)
def test_depth_and_length_of_toml_are_bounded(tmp_path: Path, text: str) -> None:
    path = put(tmp_path, GOOD, SENSOR + text + "\n")
    assert error(path).startswith("sensor.toml")


def test_columns_are_bounded(tmp_path: Path) -> None:
    names = ",".join(f"c{i}" for i in range(20_000))
    assert error(put(tmp_path, names + "\n")) == "touches.csv, row 1: expected at most 10000 columns, got 20000"


def test_names_in_files_lead_nowhere(tmp_path: Path) -> None:
    """No text in a data set is taken for a path: a save writes into the folder that it was given, and nowhere else."""
    inside = tmp_path / "a" / "b"
    inside.mkdir(parents=True)
    outside = "../../outside"
    (tmp_path / "sensor").mkdir()
    sensor = f'name = "{outside}"\n{SENSOR}[source]\n"{outside}" = "{outside}"\nfile = "/etc/passwd"\n'
    header = (
        GOOD.replace("e02", f"e02,{outside}", 1).replace("0\n", "0,x\n").replace("1\n", "1,x\n").replace("2\n", "2,x\n")
    )
    dataset = load_dataset(put(tmp_path / "sensor", header, sensor))
    assert dataset.sensor.name == outside and outside in dataset.touches.extra
    before = {path for path in tmp_path.rglob("*")}
    for kind in ("csv", "parquet"):
        bayestouch.save_dataset(dataset, inside / kind, kind)  # type: ignore[arg-type]
    new = {path for path in tmp_path.rglob("*")} - before
    assert new and all(path.is_relative_to(inside) for path in new)


START = '[[effect]]\nname = "crosstalk"\nstart = { %s }\n'


@pytest.mark.parametrize(
    "text",
    [
        "effect = " + "[" * 100_000,
        "a" + ".a" * 10_000 + " = 1",
        "[[effect]]\nname = []\n",
        START % f"share = {10**400}",
        START % "share = nan",
        START % f"share = {'9' * 5000}",
        "\udcff",
    ],
    ids=["deep", "dotted", "a list for a name", "no double", "nan", "digits", "no UTF-8"],
)
def test_a_model_file_from_anyone_is_refused_in_one_line(tmp_path: Path, text: str) -> None:
    from bayestouch.effects import read_model

    path = tmp_path / "model.toml"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError) as caught:
        read_model(path)
    assert "\n" not in str(caught.value) and str(caught.value).startswith(str(path))


def diagnosis_file(folder: Path, **changes: object) -> Path:
    """What a report needs of a diagnosis, as `diagnose` writes it, with changes."""
    errors = {"prediction_error_percent_peak": 1.2, "lack_of_fit": None}
    effect = {
        "name": "crosstalk",
        "summary": "leak",
        "parameters": {"share": {"mean": 0.1, "sd": None, "unit": ""}},
        "indistinguishable_from": [],
    }
    numbers = {
        "verdict": "explained",
        "data": {"elements": 2, "held_out_touches": 3},
        "before": errors,
        "after": errors,
        "noise_floor_percent_peak": 0.7,
        "effects": [effect],
        "candidates": [],
        "unexplained": {"fraction": 0.0, "where": "nowhere"},
        "correction": None,
        "measure": None,
        "figures": [],
    }
    (folder / "diagnosis.json").write_text(json.dumps(numbers | changes), encoding="utf-8")
    return folder


FIGURE = dict.fromkeys(("section", "title", "caption", "alt"), "") | {"format": "svg"}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"verdict": "<script>"}, "at 'verdict'"),
        ({"verdict": ["explained"]}, "at 'verdict'"),
        ({"before": {}}, "with 'prediction_error_percent_peak' at 'before'"),
        ({"after": {"prediction_error_percent_peak": "1"}}, "a number or null"),
        ({"noise_floor_percent_peak": float("nan")}, "no JSON"),
        ({"noise_floor_percent_peak": 10**400}, "a number or null"),
        ({"unexplained": {"fraction": True, "where": ""}}, "a number at 'unexplained.fraction'"),
        ({"effects": [None]}, "an object at 'effects[0]'"),
        ({"measure": {"advice": 3}}, "text at 'measure.advice'"),
        ({"notes": [""] * 400_000}, "at most 10000 entries at 'notes', got 400000"),
        ({"notes": [""] * 2_000_000}, "at most 2000000 bytes"),
        ({"notes": "\ud800"}, "no JSON"),  # half of a character, which no file in UTF-8 can hold
        ({"figures": [FIGURE | {"name": "/../../x"}]}, "a figure's name of letters"),
        ({"figures": [FIGURE | {"name": "absent"}]}, "no such file"),
        ({"data": {"elements": 99, "held_out_touches": 1}}, "a diagnosis of a sensor with"),
    ],
)
def test_a_diagnosis_that_no_diagnose_wrote_is_refused(tmp_path: Path, changes: dict[str, object], said: str) -> None:
    data = load_dataset(put(tmp_path, GOOD))
    assert "explained" in saved_diagnosis(diagnosis_file(tmp_path), data).numbers["verdict"]
    with pytest.raises(InputError, match=re.escape(said)) as caught:
        saved_diagnosis(diagnosis_file(tmp_path, **changes), data)
    assert "\n" not in str(caught.value)


def test_a_diagnosis_nested_without_end_is_refused(tmp_path: Path) -> None:
    (tmp_path / "diagnosis.json").write_text("[" * 1_000_000, encoding="utf-8")
    with pytest.raises(InputError, match="no JSON"):
        read_diagnosis(tmp_path / "diagnosis.json")
