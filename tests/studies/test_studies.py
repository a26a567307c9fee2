"""Studies of designs, of places and of measured pads, run small, and their numbers."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from study_modules import is_drawn, study

SHARED = Path(os.environ.get("BAYESTOUCH_SHARED", Path(__file__).parents[3] / "shared"))


@pytest.mark.slow
def test_design_questions(tmp_path: Path) -> None:
    """Closer elements and less noise help; averaging helps until the lack of fit is reached."""
    found = study("design_questions").main(small=True, folder=tmp_path)
    for vary in ("spacing_mm", "noise_percent"):
        assert np.all(np.diff(found.maps[vary].rms()) > 0)
    exact, missing = found.averaging.values()
    assert missing.floor > 5 * exact.floor
    assert missing.enough() < 10 < exact.enough()
    assert is_drawn(tmp_path / "design_questions.png")


def test_distinguishability() -> None:
    """The noise of Table 1 allows finer distinctions than Table 4's noise in R, which the paper goes by."""
    module = study("nicolson_fearing/distinguishability")
    rows = {row.key: row for row in module.main(small=True)}
    assert 0.5 < rows["radius_error.distinguishable"].ours < 1.5
    assert rows["radius_error.level"].ours > 95
    known = module.sensors()[0].known()
    averaged = module.threshold_radii(known, [0.0, 4.4], samples=20, use_load=False)
    assert averaged[1] < averaged[0]  # elements are sweet spots


@pytest.mark.slow
def test_sweet_spots(tmp_path: Path) -> None:
    """Errors are as large as predicted, and where the model misses something their sign is predicted too."""
    by_size, by_sign, _ = study("nicolson_fearing/sweet_spots").main(small=True, folder=tmp_path)
    # 51 errors that neighbours and tips share: a root mean square is good to a quarter or so
    assert 0.6 < by_size[0].ratio < 1.5
    assert by_sign[0].score.r_squared > 0.2
    assert by_sign[0].score.rank_correlation > 0.4
    assert np.abs(by_sign[0].seen_by_map.error).mean() < np.abs(by_sign[0].seen.error).mean()
    assert is_drawn(tmp_path / "sweet_spots.png")


@pytest.mark.slow
def test_sweet_spots_of_places(tmp_path: Path) -> None:
    """What edges leave over at a place foretells the bias of other tips there, and nothing where nothing is missing."""
    found = study("nicolson_fearing/sweet_spots_of_places").main(small=True, folder=tmp_path)
    both, none = found["of both"][0], found["none"][0]
    assert both.score.r_squared > 0.5
    assert both.seen.shared > 0.6
    assert abs(none.score.r_squared) < 0.2  # nothing is predicted, up to what noise leaves of the shrinking
    assert is_drawn(tmp_path / "sweet_spots_of_places.png")


@pytest.mark.slow
@pytest.mark.skipif(not (SHARED / "measured").is_dir(), reason="the folder of measured data is absent")
def test_sweet_spots_of_a_measured_pad(tmp_path: Path) -> None:
    """Spread and bias of the barometers' locations are predicted from half of the touches."""
    module = study("sweet_spots_measured")
    (found,) = module.main(small=True, folder=tmp_path)
    some = found.inside
    assert is_drawn(tmp_path / "sweet_spots_baro-line.png")
    # 18 touches: their root mean square is good to a sixth; twice that
    assert module.rms(found.error[some]) == pytest.approx(module.rms(found.spots.sd[some]), rel=0.35)
    sign = module.explained_sign(found.predicted_bias[some].T, found.kernel_error[some].T)
    assert sign.r_squared > 0.6


@pytest.mark.slow
@pytest.mark.skipif(not (SHARED / "measured").is_dir(), reason="the folder of measured data is absent")
def test_measured_diagnosis(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Traced effects lower the error on touches that nothing has seen; numbers of the full run are in the docs."""
    module = study("measured_diagnosis")
    found = {each.case.name: each for each in module.main(small=True, folder=tmp_path)}
    line, fluid = found["baro-line"], found["fluid-oil-1.5"]
    assert line.diagnosis.effects[0] == "creep_by_element"
    # The load runs from 1 to 8 N, and the pressure of the channel flattens long before.
    assert fluid.diagnosis.effects[0] == "load_nonlinearity"
    steps = dict(module.steps_percent(fluid))
    assert steps["load_nonlinearity"] < 0.5 * steps["linear"]
    # Two samples of a touch differ by creep; the load's curve is one sample a touch.
    assert [row[1] for row in module.error_rows(line)][:2] == ["samples", "touch means"]
    assert len(module.error_rows(fluid)) == 1
    samples, means = (dict(module.steps_percent(line, kind)) for kind in (module.of_samples, module.of_touches))
    assert samples["creep_by_element"] < 0.5 * samples["linear"] and means["linear"] < 0.6 * samples["linear"]
    assert "verdict" in capsys.readouterr().out
    assert is_drawn(tmp_path / "measured_diagnosis.png")
