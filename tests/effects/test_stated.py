"""What a model.toml may say of effects."""

from __future__ import annotations

import pytest

from bayestouch.effects.stated import StatedModel
from bayestouch.errors import InputError

ONE = """
[[effect]]
name = "crosstalk"
stage = "element"
start = {share = 0.1}
"""


def test_effects_with_their_starts() -> None:
    assert StatedModel.from_toml(ONE).effects == (("crosstalk", {"share": 0.1}),)


@pytest.mark.parametrize(
    ("text", "column", "said"),
    [
        (ONE + ONE, "effect.name", "crosstalk is there more than once"),
        (ONE.replace("start", "starts"), "effect.starts", "expected name, stage and start"),
        (ONE.replace('"element"', '"readout"'), "effect.stage", 'expected "element", the stage of crosstalk'),
        (ONE + "share = 0.2", "effect.share", "expected name, stage and start"),
        ('contact = "herz"' + ONE, "contact", "did you mean hertz"),
        ('body = "pad"\ncontact = "hertz"' + ONE, "contact", "a pad has no contact model"),
    ],
)
def test_what_would_be_ignored_is_refused(text: str, column: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as found:
        StatedModel.from_toml(text)
    assert found.value.column == column
