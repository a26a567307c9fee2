"""Results rebuilt from the groups of a file: what is not as it should be is refused in words."""

from __future__ import annotations

import pytest

from bayestouch.errors import InputError
from bayestouch.results.from_groups import notes_of


def test_notes_of_a_damaged_file_are_refused_in_words() -> None:
    """Text that is no JSON, JSON of another kind and nothing at all are errors of the file, not of the program."""
    assert notes_of({"notes": '["one", "two"]'}) == ("one", "two")
    for damaged in ({"notes": "[broken"}, {"notes": '{"one": 1}'}, {}):
        with pytest.raises(InputError, match="a list"):
            notes_of(damaged)
