"""Posteriors written block by block: the same numbers as in memory, whatever is kept and however often it is killed."""

from __future__ import annotations

import json
from pathlib import Path

import arviz as az
import numpy as np
import pytest
import xarray as xr
from known_fingers import dataset, known_touches
from same_touches import same_touches
from streamed_cases import DRAWS, blocks_of_seven, calibrated, same, saved

import bayestouch
from bayestouch.commands.cli import main
from bayestouch.data import parquet, tables, touch_source
from bayestouch.data import survey as survey_module
from bayestouch.data.touch_source import joined_touches
from bayestouch.data.touch_table import read_touches, write_touches
from bayestouch.data.touches import Touches
from bayestouch.errors import InputError
from bayestouch.results import netcdf as posterior_file
from bayestouch.results.draws_on_file import DrawsOnFile, NoDraws
from bayestouch.results.objects import Calibration, TouchPosteriors
from bayestouch.results.summaries import STATISTICS, summarise


@pytest.fixture(scope="module")
def read() -> tuple[Touches, Calibration]:
    return calibrated()


@pytest.fixture
def small_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    blocks_of_seven(monkeypatch)


@pytest.fixture(scope="module")
def whole(read: tuple[Touches, Calibration]) -> TouchPosteriors:
    return bayestouch.infer(*read, draws=DRAWS, seed=5)


@pytest.mark.usefixtures("small_blocks")
def test_a_file_of_blocks_holds_what_memory_would(
    read: tuple[Touches, Calibration], whole: TouchPosteriors, tmp_path: Path
) -> None:
    path = tmp_path / "posterior.nc"
    streamed = bayestouch.infer(*read, draws=DRAWS, seed=5, output=path)
    assert len(streamed.rows.touch) > 3 * 7, "several blocks, the last of them not full"
    same(streamed, whole)
    assert [each.name for each in tmp_path.iterdir()] == ["posterior.nc"], "nothing is left beside it"
    # and to the last attribute what saving from memory writes, but for the summary
    whole.save(tmp_path / "memory.nc")
    with xr.open_datatree(path, engine="h5netcdf") as mine, xr.open_datatree(tmp_path / "memory.nc") as memory:
        assert mine.attrs == memory.attrs
        assert set(mine.children) == {*memory.children, "summary"}
        for name in memory.children:
            xr.testing.assert_identical(mine[name].to_dataset(), memory[name].to_dataset())
        assert mine["summary"]["R"].sel(statistic="q95").dims == ("touch",)
        assert mine["summary"]["R"].attrs["units"] == "mm"


@pytest.mark.usefixtures("small_blocks")
def test_a_link_leads_to_the_file_that_is_written(
    read: tuple[Touches, Calibration], whole: TouchPosteriors, tmp_path: Path
) -> None:
    link = tmp_path / "link.nc"
    (tmp_path / "results").mkdir()
    link.symlink_to(Path("results") / "posterior.nc")
    same(bayestouch.infer(*read, draws=DRAWS, seed=5, output=link), whole)
    assert link.is_symlink()
    same(bayestouch.load(tmp_path / "results" / "posterior.nc"), whole)


@pytest.mark.usefixtures("small_blocks")
@pytest.mark.parametrize("where", ["memory", "file"])
def test_draws_are_thinned_and_summaries_are_of_all(
    read: tuple[Touches, Calibration], whole: TouchPosteriors, where: str, tmp_path: Path
) -> None:
    path = tmp_path / "thinned.nc"
    output = path if where == "file" else None
    thinned = bayestouch.infer(*read, draws=DRAWS, seed=5, thin=3, output=output)
    for name, draws in whole.posterior.items():
        np.testing.assert_array_equal(thinned.posterior[name], draws[:, ::3])
        np.testing.assert_allclose(thinned.mean(name), whole.mean(name), rtol=1e-12)
        np.testing.assert_allclose(thinned.sd(name), whole.sd(name), rtol=1e-9)
        np.testing.assert_allclose(thinned.interval(name), whole.interval(name), rtol=1e-12)
    np.testing.assert_array_equal(thinned.sample_stats["ess_bulk"], whole.sample_stats["ess_bulk"])
    if where == "file":
        same(bayestouch.load(path), thinned)
        assert dict(az.from_netcdf(path)["posterior"].sizes)["draw"] == 11


@pytest.mark.usefixtures("small_blocks")
@pytest.mark.parametrize("where", ["memory", "file"])
def test_summaries_alone(read: tuple[Touches, Calibration], whole: TouchPosteriors, where: str, tmp_path: Path) -> None:
    path = tmp_path / "summary.nc"
    output = path if where == "file" else None
    alone = bayestouch.infer(*read, draws=DRAWS, seed=5, summary_only=True, output=output)
    assert len(alone.posterior) == 0
    assert "R" not in alone.posterior
    with pytest.raises(InputError, match="only summaries were kept"):
        alone.posterior["R"]
    for name in whole.posterior:
        np.testing.assert_allclose(alone.mean(name), whole.mean(name), rtol=1e-12)
        np.testing.assert_allclose(alone.interval(name), whole.interval(name), rtol=1e-12)
    table, full = alone.to_dataframe(), whole.to_dataframe()
    assert list(table.columns) == list(full.columns)
    np.testing.assert_allclose(table["q95"], full["q95"], rtol=1e-12)
    for key, values in whole.sample_stats.items():
        np.testing.assert_array_equal(alone.sample_stats[key], values)
    if where == "file":
        assert isinstance(alone.posterior, NoDraws)
        with pytest.raises(InputError, match="only summaries were kept"):
            alone.interval("R", 0.5)
        groups = az.from_netcdf(path).groups  # a method before ArviZ 1, names with a slash from there on
        assert "posterior" not in {name.strip("/") for name in (groups() if callable(groups) else groups)}
        with xr.open_datatree(path, engine="h5netcdf") as tree:
            assert list(tree["summary"]["statistic"].values) == list(STATISTICS)
            assert tree["sample_stats"]["grade"].dims == ("touch",)
        again = tmp_path / "again.nc"
        alone.save(again)
        np.testing.assert_array_equal(bayestouch.load(again).mean("R"), alone.mean("R"))


def test_summaries_are_those_of_numpy() -> None:
    rng = np.random.default_rng(0)
    draws = rng.normal(size=(4, 25, 9)) * 10.0 ** np.arange(-4, 5)
    draws[:, 3:9, 8] = np.inf  # a flat's r_c
    mean, sd, *quantiles = summarise({"x": draws})["x"]
    flat = draws[..., :8].reshape(-1, 8)
    np.testing.assert_allclose(mean[:8], flat.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(sd[:8], flat.std(axis=0), rtol=1e-12)
    np.testing.assert_allclose(np.array(quantiles)[:, :8], np.quantile(flat, [0.05, 0.5, 0.95], axis=0), rtol=1e-12)
    assert np.isinf(mean[8])
    assert np.isnan(sd[8])
    last = draws[..., 8].ravel()
    np.testing.assert_array_equal(
        np.array(quantiles)[:, 8], np.quantile(last, [0.05, 0.5, 0.95], method="inverted_cdf")
    )


@pytest.mark.usefixtures("small_blocks")
def test_large_draws_stay_on_file(
    read: tuple[Touches, Calibration],
    whole: TouchPosteriors,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(posterior_file, "LARGEST_IN_MEMORY", 1000)
    path = tmp_path / "posterior.nc"
    lazy = bayestouch.infer(*read, draws=DRAWS, seed=5, output=path)
    assert isinstance(lazy.posterior, DrawsOnFile)
    same(lazy, whole)
    np.testing.assert_array_equal(lazy.posterior.some("R", slice(3, 5)), whole.posterior["R"][..., 3:5])
    with pytest.raises(KeyError):
        lazy.posterior["x"]
    lazy.save(tmp_path / "copy.nc")
    path.write_bytes(b"something else")
    with pytest.raises(InputError, match="has changed since"):
        lazy.posterior["R"]


@pytest.mark.usefixtures("small_blocks")
def test_pads_are_written_in_blocks(tmp_path: Path) -> None:
    simulated = bayestouch.simulate(bayestouch.simulation.PadDesign(), seed=1)
    touches = simulated.dataset.touches
    touches = touches.select(np.isin(touches.touch, np.unique(touches.touch)[:17]))
    calibration = bayestouch.calibrate(simulated.dataset, kernel="half-space", draws=40)
    memory = bayestouch.infer(touches, calibration, draws=DRAWS, seed=2)
    same(bayestouch.infer(touches, calibration, draws=DRAWS, seed=2, output=tmp_path / "pad.nc"), memory)


# Tables that are read piece by piece.


def _several_samples() -> Touches:
    """Touches of three samples and two rows without contact each, some without a load, not in the order of ids."""
    data = dataset(known_touches(3, step=3.0)).touches
    rng = np.random.default_rng(1)
    load = np.where(rng.random(data.n_rows) < 0.05, np.nan, data.load)
    away = data.select(np.unique(data.touch, return_index=True)[1])
    away = away.with_(readings=0.02 * away.readings, load=np.zeros(away.n_rows), sample=np.full(away.n_rows, 9))
    data = joined_touches([data.with_(load=load), away])
    return data.select(np.lexsort((data.sample, (data.touch * 700) % 1009)))


@pytest.mark.slow
@pytest.mark.usefixtures("small_blocks")
@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize("each_sample", [False, True])
def test_a_file_in_pieces_is_read_like_one_in_memory(
    read: tuple[Touches, Calibration],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    ending: str,
    each_sample: bool,
) -> None:
    if ending == "parquet":
        pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    path, calibration = tmp_path / f"touches.{ending}", read[1]
    write_touches(_several_samples(), path, calibration.sensor)
    options = {"draws": 64, "seed": 5, "method": "importance", "each_sample": each_sample}
    whole = bayestouch.infer(read_touches(path, calibration.sensor), calibration, **options)  # type: ignore[arg-type]
    for module in (tables, parquet):
        monkeypatch.setattr(module, "CHUNK", 23)
    monkeypatch.setattr(touch_source, "READ_WHOLE", 0)
    assert len(list(touch_source.source_of(path, calibration.sensor).pieces())) > 5
    same(bayestouch.infer(path, calibration, **options), whole)  # type: ignore[arg-type]
    monkeypatch.setattr(touch_source, "ROOM", 0)
    same(bayestouch.infer(path, calibration, output=tmp_path / "a.nc", **options), whole)  # type: ignore[arg-type]


def test_touches_that_do_not_stand_together_are_read_whole(
    read: tuple[Touches, Calibration], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, calibration = tmp_path / "touches.csv", read[1]
    data = _several_samples()
    write_touches(data.select(np.argsort(data.sample, kind="stable")), path, calibration.sensor)
    options = {"draws": 64, "seed": 5, "method": "importance"}
    whole = bayestouch.infer(read_touches(path, calibration.sensor), calibration, **options)  # type: ignore[arg-type]
    monkeypatch.setattr(tables, "CHUNK", 23)
    monkeypatch.setattr(touch_source, "READ_WHOLE", 0)
    source = touch_source.source_of(path, calibration.sensor)
    with pytest.raises(touch_source.Scattered):
        list(source.pieces())
    same(bayestouch.infer(path, calibration, **options), whole)  # type: ignore[arg-type]


def test_a_large_table_is_looked_at_evenly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(survey_module, "SAMPLED", 4)
    data = _several_samples()
    ids = list(dict.fromkeys(data.touch.tolist()))
    found = survey_module.survey(touch_source.InMemory(data))
    assert found.n_touches == len(ids) == 47
    # 47 touches, at most eight of them: every eighth
    assert list(dict.fromkeys(found.sample.touch.tolist())) == ids[::8]
    assert found.sample.n_rows == 5 * 6, "with all their rows"


def test_a_file_that_changes_is_refused(
    read: tuple[Touches, Calibration], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(touch_source, "READ_WHOLE", 0)
    path = tmp_path / "touches.csv"
    write_touches(_several_samples(), path, read[1].sensor)
    source = touch_source.source_of(path, read[1].sensor)
    path.write_text(path.read_text() + "\n")
    with pytest.raises(InputError, match="has changed"):
        next(source.pieces())


@pytest.mark.parametrize("room", [0, 1 << 20])
def test_a_file_is_read_once_where_there_is_room(
    read: tuple[Touches, Calibration], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, room: int
) -> None:
    path, times = tmp_path / "touches.csv", []
    write_touches(_several_samples(), path, read[1].sensor)
    raw = touch_source.csv_pieces
    monkeypatch.setattr(tables, "CHUNK", 23)
    monkeypatch.setattr(touch_source, "READ_WHOLE", 0)
    monkeypatch.setattr(touch_source, "ROOM", room)
    source = touch_source.source_of(path, read[1].sensor)
    monkeypatch.setattr(touch_source, "csv_pieces", lambda *a: (times.append(1), raw(*a))[1])
    first, again = list(source.pieces()), list(source.pieces())
    assert len(times) == (1 if room else 2)
    assert len(first) == len(again) > 5
    assert all(same_touches(one, other) and one.notes == other.notes for one, other in zip(first, again, strict=True))
    assert same_touches(source.whole(), _several_samples())


@pytest.mark.slow
def test_the_command_says_how_many_missed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files, path = saved(tmp_path), tmp_path / "posterior.nc"
    arguments = ["infer", str(files[0] / "touches.csv"), "--calibration", str(files[1]), "-o", str(path)]
    assert main([*arguments, "--draws", "128", "--summary-only"]) == 0
    said = capsys.readouterr().out
    result = bayestouch.load(path)
    assert isinstance(result, TouchPosteriors)
    missed = int((result.sample_stats["grade"] == 0).sum())
    assert (f"{missed} missed the targets" if missed else "all meet the targets") in said
    # a thousand times the loads of the calibration
    table = read_touches(files[0] / "touches.csv", result.sensor)
    write_touches(table.with_(load=1000 * table.load), tmp_path / "hard.csv", result.sensor)
    hard = ["infer", str(tmp_path / "hard.csv"), *arguments[2:], "--draws", "128", "--no-check"]
    assert main([*hard, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["touches"], facts["beyond_priors"], facts["missed_targets"]) == (len(result), len(result), 0)
    assert main(hard) == 0
    assert f"{len(result)} are beyond the loads or places of the calibration" in capsys.readouterr().out
    assert main([*arguments, "--draws", "128", "--thin", "200"]) == 2
    assert "thin" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("options", "words"),
    [({"thin": 0}, "thin"), ({"thin": 100}, "thin"), ({"output": "."}, "folder"), ({"output": "no/x.nc"}, "no/x.nc")],
)
def test_options_that_cannot_be(read: tuple[Touches, Calibration], options: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        bayestouch.infer(*read, draws=DRAWS, **options)  # type: ignore[arg-type]
