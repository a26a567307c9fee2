"""The page of `make report`, which leads to both reports; here the sensors are smaller, so that it takes a minute."""

from __future__ import annotations

from pathlib import Path

import pytest
from report_cases import FINGER, LINE
from study_modules import study

from bayestouch.data.dataset import save_dataset
from bayestouch.simulation import simulate

SENSORS = {"finger": (FINGER, {"crosstalk": 0.06}), "fluid-oil-1.5": (LINE, {"creep": 0.2})}


@pytest.mark.slow
def test_the_page_leads_to_both_reports(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    module = study("first_reports")
    run = module.run

    def smaller(verb: str, *arguments: str | Path) -> None:
        if verb == "report":
            run(verb, *arguments, "--draws", "64", "--quiet")
        else:
            design, effects = SENSORS[str(arguments[0])]
            save_dataset(simulate(design, effects=effects, seed=5).dataset, Path(arguments[-1]))

    monkeypatch.setattr(module, "run", smaller)
    page = module.main(tmp_path).read_text("utf-8")
    assert set(module.REPORTS) == set(SENSORS)
    for name, title in module.REPORTS.items():
        assert (tmp_path / name / "index.html").is_file()
        assert f'<a href="{name}/index.html">{title}</a>' in page
    # what each report says of its diagnosis, with errors before and after
    assert page.count("<h2>") == 2 and page.count("<th>before</th>") == 2 and page.count("<li>") >= 2


def test_a_command_that_fails_ends_it(tmp_path: Path) -> None:
    module = study("first_reports")
    with pytest.raises(SystemExit) as ended:
        module.at_once([("report", tmp_path / "absent", "-o", tmp_path / "out")])
    assert ended.value.code == 2
