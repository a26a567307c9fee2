"""The picture on the first page of the documentation, by its study on a smaller finger."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from study_modules import STUDIES, study

from bayestouch.effects import effect_classes


@pytest.mark.slow
def test_the_soft_spot_is_found_and_errors_of_the_radius_fall(tmp_path: Path) -> None:
    module = study("before_and_after")
    found = module.main(small=True, folder=tmp_path)
    diagnosis = found.diagnosis.to_dict()
    assert [effect["name"] for effect in diagnosis["effects"]] == [module.EFFECT]
    share, centre = (diagnosis["effects"][0]["parameters"][f"soft_spot_{name}"] for name in ("share", "centre"))
    # Four sd of the normal approximation.
    assert abs(share["mean"] - module.SIZE) < 4 * share["sd"]
    assert abs(centre["mean"] - module.MIDDLE_DEG) < 4 * centre["sd"]
    assert len(found.location_deg) == len(found.before_mm) == len(found.after_mm) > 5
    before, after = (np.sqrt(np.mean(each**2)) for each in (found.before_mm, found.after_mm))
    assert after < 0.7 * before
    with Image.open(tmp_path / "before_and_after.png") as picture:
        assert picture.width >= 800


def test_first_page_and_readme_show_the_picture_and_count_the_effects() -> None:
    docs = STUDIES.parent / "docs"
    for page in (docs / "index.md", STUDIES.parent / "README.md"):
        text = page.read_text("utf-8")
        assert "more than twenty" in text and len(effect_classes()) > 20
        shown = re.findall(r"!\[[^\]]+\]\(([\w./-]+before_and_after\.png)\)", text)
        assert len(shown) == 1
        assert (page.parent / shown[0]).samefile(docs / "gallery" / "before_and_after.png")
