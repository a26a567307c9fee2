"""What else a finger made by hand has: which effects the study lists, and the table of its page."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from study_modules import STUDIES, agree, study

module = study("made_by_hand")


def test_an_effect_with_a_low_score_may_remove_the_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """Residuals of 10, of which five effects leave 9, 8, 6, 8.5 and 1: by hand 19, 36, 64, 28 and 99 %."""
    leaves = {"first": 9.0, "second": 8.0, "third": 6.0, "fourth": 8.5, "fifth": 1.0}
    monkeypatch.setattr(module, "left", lambda each: each)
    monkeypatch.setattr(module, "fit_with", lambda effect, base, start: SimpleNamespace(fitted=leaves[effect.name]))
    candidates = [SimpleNamespace(effect=SimpleNamespace(name=name), start=()) for name in leaves]
    shares, names = zip(*module.removed(10.0, candidates), strict=True)
    assert names == ("fifth", "third", "second", "fourth", "first")
    assert shares == pytest.approx((0.99, 0.64, 0.36, 0.2775, 0.19))


@pytest.mark.slow
def test_the_table_of_the_page() -> None:
    """The page has what the study prints, without the tips that stick."""
    page = (STUDIES.parent / "docs" / "made_by_hand.md").read_text("utf-8")
    printed = page.partition("<!-- table of studies/made_by_hand.py -->")[2].partition("<!-- end of")[0]
    assert agree(module.main([name for name in module.PROPERTIES if name != "sticking_tip"]), printed.strip() + "\n")
