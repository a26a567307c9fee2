"""Items prepared by another thread: the same items in the same order, and no thread is left."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from bayestouch.parallel.ahead import ahead


def test_one_item_is_prepared_while_the_one_before_is_used() -> None:
    prepared: list[int] = []
    second = threading.Event()

    def items() -> Iterator[int]:
        for k in range(3):
            prepared.append(k)
            if k == 1:
                second.set()
            yield k

    got = ahead(items())
    assert next(got) == 0
    assert second.wait(10) and 2 not in prepared  # one ahead, no more
    assert list(got) == [1, 2]
    assert threading.active_count() == 1


def test_an_error_is_raised_after_the_items_before_it() -> None:
    def items() -> Iterator[int]:
        yield 1
        raise ValueError("bad")

    got = ahead(items())
    assert next(got) == 1
    with pytest.raises(ValueError, match="bad"):
        next(got)
    assert threading.active_count() == 1


def test_a_reader_that_stops_early_leaves_no_thread() -> None:
    got = ahead(iter(range(100)))
    assert next(got) == 0
    got.close()  # type: ignore[attr-defined]
    assert threading.active_count() == 1
