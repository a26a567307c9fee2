"""Elements that stop reading: readings that fall with the distance, and are zero from a touch on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bayestouch
from bayestouch.data.dataset import DataSet
from bayestouch.data.touches import Touches, touches_from
from bayestouch.model.silent import means_by_table, silent_elements, silent_touches
from bayestouch.model.split_data import SplitData
from bayestouch.simulation import PadDesign, simulate

SENSOR = simulate(PadDesign(element_x_mm=(0.0, 5.0, 10.0), element_y_mm=None, n_touches=1), seed=0).dataset.sensor
PLACES = np.array([0.0, 5.0, 10.0])


def pressed(x: np.ndarray, *, width: float = 2.0, offset: float = 0.0) -> Touches:
    """Touches at x with loads from 1 to 3 that read the offset and the load over 1 + (distance/width)², times 100."""
    rng = np.random.default_rng(1)
    load = rng.uniform(1, 3, len(x))
    readings = 100 * load[:, None] / (1 + (x[:, None] - PLACES) ** 2 / width**2) + offset
    noisy = readings + 0.5 * rng.standard_normal(readings.shape)
    return touches_from(np.arange(len(x)), noisy, x_mm=x, load=load, time_s=5.0 * np.arange(len(x)))


def dead(table: Touches, element: int, touch: int) -> Touches:
    """From this touch on the element reads nothing but a noise about zero, whatever its offset."""
    rng = np.random.default_rng(2)
    readings = table.readings.copy()
    later = table.touch >= touch
    readings[later, element] = 0.5 * rng.standard_normal(later.sum())
    return table.with_(readings=readings)


def said_of(dataset: DataSet) -> tuple[str, ...]:
    return silent_elements(dataset, means_by_table(dataset))


ANYWHERE = np.random.default_rng(0).uniform(-2, 12, 120)


def first_silent(x: np.ndarray, element: int, touch: int, within: float) -> int:
    """First touch from this one on that is within a distance of the element."""
    return next(k for k in range(touch, len(x)) if abs(x[k] - PLACES[element]) <= within)


@pytest.mark.parametrize("offset", [0.0, 400.0])
def test_an_element_that_dies_half_way_is_named_with_the_touch(offset: float) -> None:
    """By the kernel it reads a quarter up to 2 √3 mm; by seven tenths of nearly that, 2.2 to 2.6 mm count."""
    table = dead(pressed(ANYWHERE, offset=offset), 1, 57)
    (line,) = said_of(DataSet(SENSOR, None, table))
    named = int(line.split(" from touch ")[1].split()[0])
    assert line.startswith("e02 reads nothing from touch ")
    if offset == 0:
        assert named in {first_silent(ANYWHERE, 1, 57, within) for within in (2.2, 2.4, 2.6)}
    assert named >= 57
    # In two tables, and with times and not the rows in order.
    both = DataSet(SENSOR, table.select(table.touch < 40), table.select(table.touch >= 40))
    assert said_of(both) == (line.replace(f"touch {named} on", f"touch {named} of the touches to be read on"),)
    shuffled = table.select(np.random.default_rng(5).permutation(table.n_rows))
    assert said_of(DataSet(SENSOR, None, shuffled)) == (line,)


def test_check_and_diagnosis_name_it() -> None:
    table = dead(pressed(ANYWHERE), 2, 60)
    dataset = DataSet(SENSOR, None, table)
    (line,) = said_of(dataset)
    assert line in bayestouch.check(dataset).facts["advice"] and line in SplitData.of(dataset).notes
    # In touches that are read later, and not in a calibration on a clock that begins again.
    sound = pressed(ANYWHERE)
    for touch in (0, 60):
        notes = SplitData.of(DataSet(SENSOR, sound, dead(sound, 2, touch))).notes
        (line,) = (each for each in notes if each.startswith("e03 reads nothing from touch "))
        named, table_name = line.split(" from touch ")[1].split(" of the ")
        assert table_name.startswith("touches to be read on (") and touch <= int(named) < touch + 20


@pytest.mark.parametrize("width", [0.5, 2.0, 8.0])
@pytest.mark.parametrize(
    "x", [ANYWHERE, np.sort(ANYWHERE), np.sort(ANYWHERE)[::-1], np.tile(np.linspace(-2, 12, 30), 4)]
)
def test_sound_elements_are_not_named(x: np.ndarray, width: float) -> None:
    """Scans as well: their last touches are far from the first elements, which rightly read nothing of them."""
    table = pressed(x, width=width)
    assert said_of(DataSet(SENSOR, None, table)) == ()
    # Dead from the beginning, or nearly at the end; and without loads or places nothing is said.
    for other in (dead(table, 1, 0), dead(table, 1, len(x) - 4), table.with_(load=np.full(len(x), np.nan))):
        assert said_of(DataSet(SENSOR, None, other)) == ()
    lost = dead(table, 1, 50).with_(x_mm=np.full(len(x), np.nan))
    assert said_of(DataSet(SENSOR, None, lost)) == ()


def test_touches_that_an_element_should_read() -> None:
    """Six touches read at distances up to 3: later ones up to 2.1 count, and there must be five."""
    distance = np.array([0.0, 1, 2, 3, 1, 2, 9, 9, 1, 2, 2.5, 0, 1, 2, 9])
    read = np.where(distance < 5, 1.0, 0.0)
    read[8:] = 0.05
    np.testing.assert_array_equal(silent_touches(distance, read, read), [8, 9, 11, 12, 13])
    assert not len(silent_touches(distance[:13], read[:13], read[:13]))
    # One reading of a tenth is no silence.
    read[13] = 0.11
    assert not len(silent_touches(distance, read, read))
    read[13] = 0.05
    assert len(silent_touches(distance, np.where(read < 0.1, 0.9, read), read)) == 5


def test_light_touches_do_not_count() -> None:
    """Below a quarter of the mean load."""
    table = pressed(ANYWHERE)
    light = (table.touch >= 60) & (np.abs(ANYWHERE - 5) < 4)
    readings = table.readings.copy()
    readings[light] = 0.0
    soft = replace(table, readings=readings, load=np.where(light, 0.1, table.load))
    assert said_of(DataSet(SENSOR, None, soft)) == ()
