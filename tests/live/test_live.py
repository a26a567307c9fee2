"""One touch at a time: against `infer` by emcee, sample by sample, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from live_cases import apart, drawn, sensor, streamed
from place_cases import SURFACE, missed_data

import bayestouch
from bayestouch import InputError, Reader
from bayestouch.effects.stated import StatedModel
from bayestouch.finger.reading.live_effects import FingerStream, blank_context
from bayestouch.finger.reading.touch_reader import FingerTouchReader
from bayestouch.priors.indenter_text import indenter_from_text
from bayestouch.reading.live import HeldTouch
from bayestouch.reading.options import Options

# 0.1 sd and 5 % are what the reader promises. The draws themselves are wrong by 0.02 sd and 1.3 %.
MEAN, SD = 0.1, 0.05


@pytest.mark.parametrize(
    "options",
    [{}, {"use_load": False}, {"plug_in": True}, {"indenter": bayestouch.UniformCurvature(0.1)}],
    ids=["load", "no load", "plug-in", "curvature"],
)
def test_a_finger_as_by_emcee(options: dict[str, Any]) -> None:
    data, calibration = sensor("finger")
    live = streamed(Reader(calibration, **options), data.touches)
    mean, sd = apart(live, *drawn(data.touches, calibration, **options))
    assert np.mean((mean < MEAN) & (sd < SD)) >= 0.99
    assert np.median(mean) < 0.03, "the median error is that of the draws"
    assert not any(each.flags for each in live)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "size"),
    [
        ("crosstalk", 0.04),
        ("creep", 0.05),
        pytest.param("memory", 0.03, marks=pytest.mark.slow),
        # A fifth of the typical load: the mode for the load as read is far from the true one.
        ("load_offset", 40.0),
        pytest.param("load_offset", -40.0, marks=pytest.mark.slow),
    ],
)
def test_a_finger_with_an_effect_as_by_emcee(effect: str, size: float) -> None:
    data, calibration = sensor("finger", ((effect, size),), (effect,))
    mean, sd = apart(streamed(Reader(calibration), data.touches), *drawn(data.touches, calibration))
    assert np.mean((mean < MEAN) & (sd < SD)) >= 0.99


def test_creep_of_an_element_is_averaged_over_the_samples_that_have_its_reading() -> None:
    """The mean over the last six of ten samples follows from those over the first four and over all."""
    data, calibration = sensor("finger", (("creep", 0.05),), ("creep",))
    chain = FingerTouchReader.from_calibration(calibration, Options()).effects_chain
    assert chain is not None
    m, load = chain.model.n_elements, float(data.touches.load[0])

    def factors(*lost: int) -> list[np.ndarray]:
        stream, held = FingerStream(chain, exact=True), HeldTouch.none(m)
        stream.begin(0.0)
        out = []
        for number in range(10):
            values = np.where((np.arange(m) == 2) & (number in lost), np.nan, chain.model.peak)
            held = stream.add(held, values, load, 0.2 * number, 1.0)
            out.append(stream.context().scale[0])
        return out

    whole, partly, never = factors(), factors(0, 1, 2, 3), factors(*range(10))
    assert partly[-1][2] == pytest.approx((10 * whole[-1][2] - 4 * whole[3][2]) / 6, rel=1e-12)
    assert partly[-1][2] - whole[-1][2] > 0.001
    np.testing.assert_array_equal(np.delete(partly[-1], 2), np.delete(whole[-1], 2))
    np.testing.assert_array_equal(never, whole)


@pytest.mark.slow
def test_touches_before_a_stream_are_unknown_but_not_absent() -> None:
    """Touches that are read one by one, of a finger with memory: their locations were several sd off.

    `infer` knows as little of the touches before, so that both say the same.
    """
    data, calibration = sensor("finger", (("memory", 0.03),), ("memory",))
    touches, reader = data.touches, Reader(calibration)
    alone = [touches.select(touches.touch == number) for number in np.unique(touches.touch)[2:40:2]]
    live = []
    for one in alone:
        reader.restart()
        live += streamed(reader, one)
    places = [0.0 if one.angle_deg is None else float(one.angle_deg[0]) for one in alone]
    off = [(each["theta_c"][0] - place) / each["theta_c"][1] for each, place in zip(live, places, strict=True)]
    assert 0.4 < np.sqrt(np.mean(np.square(off))) < 1.4
    assert sum(not each.flags for each in live) >= 16
    mean, sd = apart(live[:1], *drawn(alone[0], calibration))
    assert mean < MEAN and sd < SD


@pytest.mark.slow
def test_touches_before_a_stream_on_a_pad_are_unknown_but_not_absent() -> None:
    """Of a pad with memory, the locations of touches that are read one by one were 10 sd off."""
    data, calibration = sensor("line", (("memory", 0.1),), ("memory",))
    touches, reader, off, last = data.touches, Reader(calibration, plug_in=True), [], []
    for number in np.unique(touches.touch)[2:40:3]:
        reader.restart()
        one = touches.select(touches.touch == number)
        assert one.x_mm is not None
        mean, sd = streamed(reader, one)[0]["x"]
        off.append((mean - one.x_mm[0]) / sd)
        last.append((one, mean, sd))
    assert 0.4 < np.sqrt(np.mean(np.square(off))) < 1.4
    one, mean, sd = last[0]
    read = bayestouch.infer(one, calibration, plug_in=True, draws=2048, workers=1)
    assert abs(read.mean("x")[0] - mean) < 0.1 * sd
    assert read.sd("x")[0] == pytest.approx(sd, rel=0.1)


def asked(data: bayestouch.DataSet, chain: Any, touch: tuple[np.ndarray, ...], reads: int) -> bayestouch.Touches:
    """Touches (R in mm, θ_c in rad, P in N/m) without noise, with `reads` samples each."""
    readings, rows = chain(*touch), np.repeat(np.arange(len(touch[0])), reads)
    return data.touches.select(np.zeros(len(rows), dtype=np.int64)).with_(
        readings=readings[rows],
        load=touch[2][rows],
        touch=rows,
        sample=np.tile(np.arange(reads), len(touch[0])),
        time_s=np.arange(len(rows)) / 20,
    )


@pytest.mark.parametrize(
    ("effect", "size", "radius", "angle_deg"),
    [
        ("gain_nonlinearity", -0.1, 4.0, 2.0),
        pytest.param("surface_profile", 0.05, 9.0, 2.0, marks=pytest.mark.slow),
        ("proximity", 0.06, 0.8, -24.0),
    ],
)
def test_an_effect_that_bends_the_readings_at_any_load(
    effect: str, size: float, radius: float, angle_deg: float
) -> None:
    """Between the loads at which the covariance is tabulated, an sd was up to 30 % too large."""
    data, one = sensor("finger", ((effect, size),), (effect,))
    reader = FingerTouchReader.from_calibration(one, Options())
    assert reader.effects_chain is not None
    load = reader.typical_load * np.array([0.8, 1.2, 1.4, 1.7, 2.0])
    touch = np.full(5, radius), np.full(5, np.radians(angle_deg)), load
    context = blank_context(reader.effects_chain, 5, exact=True)

    def chain(*touch: np.ndarray) -> np.ndarray:
        return context.readings(reader.sampler.chain.predict(*touch), *touch, np.arange(5))

    touches = asked(data, chain, touch, reads=20)
    mean, sd = apart(streamed(Reader(one), touches), *drawn(touches, one))
    assert (mean < MEAN).all() and (sd < SD).all()


def test_a_surface_of_its_own_at_any_load() -> None:
    """The readings do not depend on κ alone: at high loads an sd of R was four times too large."""
    data = missed_data(SURFACE)
    one = bayestouch.calibrate(data, discrepancy="place", draws=64, seed=1)
    reader = FingerTouchReader.from_calibration(one, Options())
    load = np.array([60.0, 200.0, 400.0, 550.0, 400.0, 550.0])
    touch = np.array([6.0, 6.0, 6.0, 6.0, 11.0, 11.0]), np.full(6, np.radians(10.0)), load
    touches = asked(data, reader.sampler.chain.predict, touch, reads=1)
    mean, sd = apart(streamed(Reader(one), touches), *drawn(touches, one))
    assert (mean < MEAN).all() and (sd < SD).all()


def test_a_touch_that_no_known_tip_makes_is_a_misfit() -> None:
    """Round tips read as a knife edge or a flat do not fit; the edges and flats of the calibration do."""
    data, one = sensor("finger")
    assert data.calibration is not None
    reader = Reader(one, indenter=bayestouch.KnownTips((0.0, np.inf)))
    assert data.calibration.angle_deg is not None
    near = data.calibration.select(np.abs(data.calibration.angle_deg) < 30)
    ends, round_tips = streamed(reader, near), streamed(reader, data.touches)
    assert np.median([each.misfit for each in ends]) > 0.1
    blunt = (radius := data.touches.averaged().indenter_radius_mm) > 3
    poor = [each for each, some in zip(round_tips, blunt & (radius < 13), strict=True) if some]
    assert max(each.misfit for each in poor) < 1e-6 and all(each.flags for each in poor)


@pytest.mark.slow
def test_a_drift_is_that_of_the_touches_before() -> None:
    """`infer` uses all other touches of the table; for the last touch these are the ones before it."""
    data, calibration = sensor("finger", (("baseline_drift", 0.01),), ("baseline_drift",))
    live = streamed(Reader(calibration), data.touches)
    mean, sd = drawn(data.touches, calibration)
    far, wide = apart(live, mean, sd)
    # The basis of `infer` interpolates the process between knots, which changes the last touch by up to 0.1 sd.
    assert far[-1] < 0.2
    assert wide[-1] < 0.1
    # The first touch knows nothing of the drift, and says so by its width.
    assert live[0].sd[1] > 1.5 * sd[0, 1]
    without, plain = sensor("finger", (("baseline_drift", 0.01),))
    ignored, _ = apart(streamed(Reader(plain), without.touches), mean, sd)
    assert np.median(far[20:]) < 0.5 * np.median(ignored[20:])


def test_tips_have_the_probabilities_of_infer() -> None:
    data, calibration = sensor("finger")
    for prior in (bayestouch.KnownTips((0.0, 1.0, 2.0, np.inf)), bayestouch.EdgeOrRound()):
        live = streamed(Reader(calibration, indenter=prior), data.touches)
        read = bayestouch.infer(
            data.touches, calibration, indenter=prior, check_sensor=False, draws=512, seed=2, workers=1
        )
        assert read.tips is not None
        assert tuple(live[0].tips) == read.tips.names
        found = np.array([list(each.tips.values()) for each in live])
        np.testing.assert_allclose(found.sum(axis=1), 1.0)
        # The evidence of `infer` is a mean of 512 even points.
        np.testing.assert_allclose(found, read.tips.probability, atol=0.02)


@pytest.mark.parametrize("kind", ["finger", "line", pytest.param("grid", marks=pytest.mark.slow)])
def test_sample_by_sample_equals_the_mean_of_all(kind: str) -> None:
    data, calibration = sensor(kind)
    rows = np.flatnonzero(data.touches.touch == data.touches.touch[0])
    readings, load = data.touches.readings[rows].copy(), data.touches.load[rows]
    reader = Reader(calibration)
    for values, each in zip(readings, load, strict=True):
        last = reader.update(values, each)
    whole = Reader(calibration).read(readings.mean(axis=0), float(load.mean()), reads=len(rows))
    assert last.samples == len(rows)
    # The region of a pad is that of the sample before; the quadrature over another region differs in the fourth digit.
    np.testing.assert_allclose((last.mean - whole.mean) / whole.sd, 0.0, atol=5e-3)
    np.testing.assert_allclose(last.sd, whole.sd, rtol=5e-3)
    one = Reader(calibration).read(readings[0], float(load[0]))
    assert last.sd[-1] < one.sd[-1]


@pytest.mark.parametrize(
    ("kind", "effects"), [("line", ()), pytest.param("grid", (("creep", 0.05),), marks=pytest.mark.slow)]
)
def test_a_pad_as_by_emcee(kind: str, effects: tuple[tuple[str, float], ...]) -> None:
    data, calibration = sensor(kind, effects, tuple(name for name, _ in effects))
    # With effects the reader leaves their uncertainty out, and says so.
    options = {"plug_in": True} if effects else {}
    live = streamed(Reader(calibration, **options), data.touches)
    mean, sd = apart(live, *drawn(data.touches, calibration, **options))
    good = (mean < MEAN) & (sd < SD)
    flagged = np.array([bool(each.flags) for each in live])
    # At the corners of a pad few elements respond, and the posterior is a curved ridge over several mm.
    assert good.mean() >= (0.99 if kind == "line" else 0.9)
    assert (good | flagged).mean() >= 0.95


@pytest.mark.parametrize("use_load", [True, False])
def test_a_pad_with_load_scatter_as_by_emcee(use_load: bool) -> None:
    """A scatter of a tenth of the loads: an sd without it would be a third of what it is, or twice as large."""
    data, calibration = sensor("line")
    scatter = 0.1 * float(np.nanmean(data.touches.load))
    calibration = replace(calibration, noise=replace(calibration.noise, load_scatter=scatter))
    touches = data.touches if use_load else data.touches.with_(load=np.full(data.touches.n_rows, np.nan))
    mean, sd = apart(streamed(Reader(calibration), touches), *drawn(touches, calibration))
    assert ((mean < MEAN) & (sd < SD)).mean() >= 0.95


def test_a_missing_element_is_left_out() -> None:
    data, calibration = sensor("finger")
    values = data.touches.readings[0].copy()
    values[0] = np.nan
    found = Reader(calibration).read(values, float(data.touches.load[0]))
    rows = data.touches.select(np.arange(data.touches.n_rows) == 0)
    mean, sd = drawn(rows.with_(readings=values[None]), calibration)
    np.testing.assert_array_less(np.abs(found.mean - mean[0]) / sd[0], MEAN)
    np.testing.assert_array_less(np.abs(found.sd / sd[0] - 1), SD)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("with_load", [True, False], ids=["load", "no load"])
def test_one_element_alone_is_read_and_flagged(with_load: bool) -> None:
    """Location and load change one reading alike, so that nothing but their priors tells them apart."""
    data, calibration = sensor("finger")
    means, reader = data.touches.averaged(), Reader(calibration)
    values = np.where(np.arange(8) == 2, means.readings, np.nan)
    loads = means.load if with_load else [None] * means.n_touches
    for reading, load in zip(values, loads, strict=True):
        found = reader.read(reading, load, reads=20)
        assert np.isfinite(found.mean).all() and (found.sd > 0).all()
        assert "readings and load are fewer than the unknowns" in found.flags
    pair = np.where(np.isin(np.arange(8), [2, 3]), means.readings[0], np.nan)
    assert reader.read(pair, float(means.load[0]), reads=20).flags == ()


@pytest.mark.parametrize("load", [0.0, -0.02])
def test_a_load_below_zero_is_no_error(load: float) -> None:
    """The force sensor has an offset, and the touch has only begun."""
    _, calibration = sensor("line")
    reader = Reader(calibration)
    found = reader.read(reader.rest_reading, load)
    assert np.isfinite(found.mean).all() and (found.sd > 0).all()
    assert (found.quantiles[-1] >= 0).all() and found.mean[-1] > 0
    assert "the location or the load is at an end of its prior" in found.flags


@pytest.mark.filterwarnings("error")
def test_without_contact_the_location_is_unknown() -> None:
    """Quadrature points have loads below zero then; the sd of a uniform location would be 0.29 of its range."""
    _, calibration = sensor("finger")
    reader, rng = Reader(calibration), np.random.default_rng(2)
    wide = reader.read(reader.rest_reading)
    low, high = np.degrees(reader._body.reader.sampler.priors.location.support)
    assert 0.15 < wide["theta_c"][1] / (high - low) < 0.3
    for _ in range(20):
        found = reader.read(reader.rest_reading + calibration.noise.tactile_sd * rng.standard_normal(8))
        assert np.isfinite(found.mean).all() and found.grade == 0


def test_a_location_at_the_end_of_the_region_of_a_pad_is_flagged() -> None:
    data, calibration = sensor("line")
    reader, means = Reader(calibration), data.touches.averaged()
    place = reader._body.reader.sampler.reader.map
    signal = reader.rest_reading + means.load.mean() * place.at(np.array([place.low, place.low + 3.0]))[0]
    ends = [reader.read(values, float(means.load.mean())) for values in signal]
    assert ends[0].flags == ("the location or the load is at an end of its prior",) and not ends[1].flags


def test_the_same_load_in_every_sample_is_one_reading_of_the_force_sensor() -> None:
    """As in `infer`: one load that was written into all rows of a touch."""
    held = HeldTouch.none(2).after(np.ones(2), 3.0, 4.0)
    assert held.reads_of_load == 4.0
    same = held.after(np.ones(2), 3.0, 4.0).after(np.ones(2), np.nan, 4.0)
    assert same.reads_of_load == 4.0 and same.load == 3.0
    assert same.after(np.ones(2), 3.5, 4.0).reads_of_load == 12.0
    assert HeldTouch.none(2).after(np.ones(2), np.nan).reads_of_load == 1.0


def test_a_load_that_was_read_once_has_the_error_of_one_read() -> None:
    """Twenty samples of a touch, of which one has a load: as the mean of the readings with one read of the load."""
    data, calibration = sensor("finger")
    table = data.touches.select(np.flatnonzero(data.touches.in_contact)[:20])
    reader = Reader(calibration)
    for row in range(20):
        held = reader.update(table.readings[row], float(table.load[row]) if row == 0 else None)
    loads = np.where(np.arange(20) == 0, table.load, np.nan)
    mean, sd = drawn(table.with_(load=loads), calibration)
    np.testing.assert_array_less(np.abs(held.mean - mean[0]) / sd[0], MEAN)
    np.testing.assert_array_less(np.abs(held.sd / sd[0] - 1), SD)


@pytest.mark.parametrize("kind", ["finger", "line"])
def test_a_misfit_is_flagged(kind: str) -> None:
    data, calibration = sensor(kind)
    values, load = data.touches.readings[0].copy(), float(data.touches.load[0])
    good = Reader(calibration).read(values, load)
    assert good.grade == 1
    assert good.misfit > 1e-3
    values[-1] += 200 * calibration.noise.tactile_sd[-1]
    values[0] -= 150 * calibration.noise.tactile_sd[0]
    bad = Reader(calibration).read(values, load)
    assert bad.grade == 0
    assert "fit no touch" in " ".join(bad.flags)


@pytest.mark.parametrize("effects", [(), ("crosstalk",)])
def test_a_saved_reader_reads_the_same(tmp_path: Path, effects: tuple[str, ...]) -> None:
    data, calibration = sensor("finger", tuple((name, 0.04) for name in effects), effects)
    reader = Reader(calibration)
    reader.save(tmp_path / "live.nc")
    again = Reader.load(tmp_path / "live.nc")
    values, load = data.touches.readings[0], float(data.touches.load[0])
    one, other = reader.read(values, load), again.read(values, load)
    np.testing.assert_array_equal(one.mean, other.mean)
    np.testing.assert_array_equal(one.covariance, other.covariance)
    assert isinstance(bayestouch.load(tmp_path / "live.nc"), bayestouch.Calibration)
    reader.rest(reader.rest_reading + 50.0)
    reader.save(tmp_path / "moved.nc")
    np.testing.assert_array_equal(Reader.load(tmp_path / "moved.nc").rest_reading, reader.rest_reading)
    calibration.save(tmp_path / "plain.nc")
    np.testing.assert_allclose(Reader.load(tmp_path / "plain.nc").read(values, load).mean, one.mean)


def test_the_rest_reading_is_subtracted() -> None:
    data, calibration = sensor("finger")
    values, load = data.touches.readings[0], float(data.touches.load[0])
    reader, shift = Reader(calibration), np.linspace(5.0, 9.0, 8)
    wanted = reader.read(values, load).mean
    # So many that their noise is nothing beside that of one reading.
    reader.rest(np.tile([reader.rest_reading + shift - 1, reader.rest_reading + shift + 1], (5000, 1)))
    np.testing.assert_allclose(reader.read(values + shift, load).mean, wanted, rtol=1e-3)


@pytest.mark.parametrize("kind", ["finger", "line"])
def test_the_noise_of_a_rest_reading_is_that_of_infer(kind: str, tmp_path: Path) -> None:
    """Four rows at rest and a touch of sixteen reads: the noise of its mean has five times the variance."""
    data, calibration = sensor(kind)
    where = data.touches.angle_deg if kind == "finger" else data.touches.x_mm
    assert where is not None
    middle = int(np.abs(where - np.median(where)).argmin())
    table = data.touches.select(np.full(2, middle))
    zero = np.zeros(table.n_elements) if calibration.rest_reading is None else calibration.rest_reading
    rest = zero + np.linspace(-1.0, 1.0, table.n_elements)
    both = table.with_(
        readings=np.stack([rest, table.readings[1]]),
        contact=np.array([0.0, 1.0]),
        reads=np.array([4.0, 16.0]),
        sample=np.arange(2),
        rest_reads=None,
    )
    drawn_ = bayestouch.infer(both, calibration, draws=4000, seed=1, check_sensor=False)
    reader = Reader(calibration)
    reader.rest(np.tile(rest, (4, 1)))
    reader.save(tmp_path / "live.nc")
    for each in (reader, Reader.load(tmp_path / "live.nc")):
        live = each.read(both.readings[1], float(both.load[1]), reads=16)
        for k, name in enumerate(live.names):
            assert live.sd[k] == pytest.approx(drawn_.sd(name)[0], rel=SD)
            assert abs(live.mean[k] - drawn_.mean(name)[0]) < MEAN * live.sd[k]
    plain = Reader(calibration).read(both.readings[1] - rest + zero, float(both.load[1]), reads=16)
    k = plain.names.index("theta_c" if kind == "finger" else "x")
    assert live.sd[k] > 1.1 * plain.sd[k]  # the calibration adds the same error to both


def test_masked_readings_are_missing() -> None:
    data, calibration = sensor("finger")
    values, out = data.touches.readings[0], np.arange(8) == 2
    masked = Reader(calibration).read(np.ma.array(np.where(out, 9999.0, values), mask=out), load=data.touches.load[0])
    missing = Reader(calibration).read(np.where(out, np.nan, values), load=data.touches.load[0])
    np.testing.assert_array_equal([masked.mean, masked.sd], [missing.mean, missing.sd])
    assert masked.sd[1] > Reader(calibration).read(values, load=data.touches.load[0]).sd[1]


def test_bad_input_gives_one_line() -> None:
    data, calibration = sensor("finger")
    reader, values = Reader(calibration), data.touches.readings[0]
    for wrong, text in (
        (values[:-1], "expected 8 readings"),
        (np.full(8, np.nan), "all readings are missing"),
        (np.where(np.arange(8) == 2, np.inf, values), "element 3 is infinite"),
        ("words", "expected numbers"),
        (np.where(np.arange(8) == 2, 1e30, values), "element 3 is infinite or too large"),
    ):
        with pytest.raises(InputError, match=text):
            reader.read(wrong)
    for load in (np.inf, -1.1e12):
        with pytest.raises(InputError, match="load: expected a finite number up to 1e12"):
            reader.read(values, load)
    load = np.where(np.arange(data.touches.n_rows) == 2, np.inf, data.touches.load)
    with pytest.raises(InputError, match=r"^row 2, column load: expected a finite number or nothing, got inf"):
        bayestouch.infer(data.touches.with_(load=load), calibration)
    for count in (0, np.inf, np.nan):
        with pytest.raises(InputError, match="reads: expected at least 1"):
            reader.read(values, reads=count)  # type: ignore[arg-type]
    for name in ("load", "reads", "time_s"):
        with pytest.raises(InputError, match=f"{name}: expected a number, got 'x'"):
            reader.read(values, **{name: "x"})
    for number in (np.inf, -1e13):
        rest = np.where(np.arange(8) == 2, number, np.zeros((5, 8)))
        with pytest.raises(InputError, match="rest reading: element 3 is infinite or too large; a missing one is NaN"):
            reader.rest(rest)
    for time in (np.datetime64("2026-01-01", "ns"), np.timedelta64(1, "ns")):
        with pytest.raises(InputError, match="time_s: expected a number, got np"):
            reader.read(values, time_s=time)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"^values: expected seconds as numbers, got timedelta64"):
        reader.read(np.zeros(8, dtype="m8[s]"))  # type: ignore[arg-type]
    for time_s in (np.nan, np.inf, -np.inf, 1.1e30, -1.1e30):
        with pytest.raises(
            InputError, match=r"^time_s: expected a number from -1e30 to 1e30, got (nan|-?inf|-?1.1e\+30)$"
        ):
            reader.read(values, time_s=time_s)
    with pytest.raises(InputError, match=r"^values: expected real numbers, got complex ones"):
        reader.read(values + 1j)
    for name in ("load", "reads", "time_s"):
        with pytest.raises(InputError, match=f"^{name}: expected a number, got np.complex128"):
            reader.read(values, **{name: np.complex128(1 + 1j)})
    with pytest.raises(InputError, match="unknown parameter 'Q'"):
        reader.read(values)["Q"]
    reader.new_touch()
    reader.update(values, time_s=5.0)
    with pytest.raises(InputError, match="expected 8 readings"):
        reader.read(values[:-1])
    assert "1 sample is held" in repr(reader)  # what is refused changes nothing
    with pytest.raises(InputError, match="not before 5 s"):
        reader.update(values, time_s=4.0)
    with pytest.raises(InputError, match="expected 8 elements"):
        reader.rest(values[:3])
    with pytest.raises(InputError, match="expected a prior over indenters"):
        Reader(calibration, indenter=2.0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="expected a calibrated sensor"):
        Reader("calibration.nc")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="a pad does not measure radii"):
        Reader(sensor("line")[1], indenter=bayestouch.EdgeOrRound())


def test_effects_of_time_need_the_time() -> None:
    data, calibration = sensor("finger", (("creep", 0.05),), ("creep",))
    with pytest.raises(InputError, match="give the time of each sample"):
        Reader(calibration).update(data.touches.readings[0])


def test_effects_that_count_in_touches_cannot_be_followed() -> None:
    """Without times in the calibration their unit is the touch: `infer` counts the touches of a table, too."""
    data, _ = sensor("finger", (("creep", 0.05),), ("creep",))
    assert data.calibration is not None
    timeless = [each.with_(time_s=np.full(each.n_rows, np.nan)) for each in (data.calibration, data.touches)]
    data = replace(data, calibration=timeless[0], touches=timeless[1])
    model = StatedModel("finger", "layer", (("creep", {}),))
    calibration = bayestouch.calibrate(data, model=model, draws=64, seed=1)
    with pytest.raises(InputError, match="its touches had no times"):
        Reader(calibration)
    rows = data.touches.select(data.touches.touch < data.touches.touch[0] + 3)
    timed = rows.with_(time_s=np.arange(rows.n_rows) * 7.0)
    one, other = (bayestouch.infer(each, calibration, check_sensor=False, draws=64, seed=2) for each in (rows, timed))
    np.testing.assert_array_equal(one.posterior["P"], other.posterior["P"])
    assert any("the touches of the calibration had no times" in each for each in other.notes)


@pytest.mark.slow
def test_a_pad_with_creep_counts_samples_that_it_does_not_use() -> None:
    data, calibration = sensor("line", (("creep", 0.05),), ("creep",))
    reader, table = Reader(calibration), data.touches
    found = [reader.update(table.readings[row], table.load[row], time_s=float(row)) for row in range(3)]
    assert calibration.settings["samples"] == "first"
    assert [each.samples for each in found] == [1, 2, 3]
    # The quadrature begins where the sample before ended.
    np.testing.assert_allclose(found[0].mean, found[2].mean, rtol=1e-6)


def test_a_location_with_a_long_tail_beside_the_elements() -> None:
    """14°, 16° and 17° beside the outer element, with indenters of another size: the readings hardly tell where it is.

    The sd of the location was up to a fifth smaller than that of the draws, without a flag.
    """
    data, calibration = sensor("finger")
    chain = FingerTouchReader.from_calibration(calibration, Options()).sampler.chain
    angle = chain.angle.max() + np.radians([14.0, 16.0, 17.0])
    touches = asked(data, chain.predict, (np.full(3, 8.0), angle, np.full(3, 200.0)), reads=1)
    options = {"indenter": indenter_from_text("R=uniform:2,6")}
    live = streamed(Reader(calibration, **options), touches)
    mean, sd = apart(live, *drawn(touches, calibration, **options))
    assert mean.max() < MEAN and sd.max() < SD
