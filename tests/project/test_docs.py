"""Every block of code in the documentation runs, and the list of the API is that of the package."""

from __future__ import annotations

import re
import shlex
import shutil
import tomllib
from pathlib import Path
from typing import Any

import matplotlib
import pytest
from report_cases import FINGER, small

import bayestouch
from bayestouch.commands.cli import main
from bayestouch.simulation import FingerDesign, save_simulated

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted(page.relative_to(ROOT).as_posix() for page in [ROOT / "README.md", *(ROOT / "docs").glob("*.md")])
BLOCK = re.compile(r"^\s*(```|~~~) ?(python|console|toml)\b|^    bayestouch .+$", re.MULTILINE)
WITH_BLOCKS = [page for page in PAGES if BLOCK.search((ROOT / page).read_text("utf-8"))]
# `studies/tutorial.py` runs this one, with its outputs (`tests/studies/test_tutorial.py`).
RUN_BY_A_STUDY = "docs/tutorial.md"
# These make whole reports, as the quick start does too, which is run always; or all groups of several posteriors.
DEAR = ("README.md", "docs/report.md", "docs/calibrate_your_own.md", "docs/arviz.md")
# What a page takes for granted; everything else it makes itself, block by block.
GIVEN = ("my-finger", "calibration.nc", "posterior.nc", "touches.csv", "touches.parquet")
SMALL = {name: getattr(FINGER, name) for name in FINGER.__dataclass_fields__}


def blocks(page: Path) -> list[tuple[str, str]]:
    """Language and text of each block that a reader would run, in order."""
    pytest.importorskip("sybil", reason="sybil is not installed (extra dev)")
    from sybil import Document
    from sybil.parsers.markdown.lexers import FencedCodeBlockLexer

    text = page.read_text("utf-8")
    document = Document(text, str(page))
    found = [
        (region.start, language, str(region.lexemes["source"]))
        for language in ("python", "console", "toml")
        for region in FencedCodeBlockLexer(language)(document)
    ]
    # commands in indented blocks
    for command in re.finditer(r"^    (bayestouch .+)$", text, re.MULTILINE):
        found.append((command.start(), "console", f"$ {command[1]}"))
    return [(language, source) for _, language, source in sorted(found)]


@pytest.fixture(scope="module")
def given(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finger smaller than the paper's, its calibration and its touches, under the names that the pages use."""
    folder = tmp_path_factory.mktemp("docs")
    made = small(FINGER)
    data = made.dataset
    # With its truth.json: pages simulate the folder anew, which replaces no measured data set.
    save_simulated(made, folder / "my-finger")
    calibration = bayestouch.calibrate(data, draws=200)
    calibration.save(folder / "calibration.nc")
    bayestouch.infer(data.touches, calibration, draws=256).save(folder / "posterior.nc")
    bayestouch.save_dataset(data, folder / "in-parquet", "parquet")
    for kind, source in (("csv", "my-finger"), ("parquet", "in-parquet")):
        shutil.copy(folder / source / f"touches.{kind}", folder)
    return folder


def run_commands(text: str) -> None:
    for line in re.findall(r"^\$ (bayestouch .+)$", text, re.MULTILINE):
        verb, *words = shlex.split(line.partition("  #")[0])[1:]
        if verb == "init" and Path(words[0]).exists():
            # The folder that is given is the one that a reader has filled in.
            words[0] = f"empty-{words[0]}"
        assert main([verb, *words]) == 0, line


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=pytest.mark.slow) if page in DEAR else page
        for page in WITH_BLOCKS
        if page != RUN_BY_A_STUDY
    ],
)
def test_blocks_run(page: str, given: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = blocks(ROOT / page)
    assert found
    for name in GIVEN:
        copy = shutil.copytree if (given / name).is_dir() else shutil.copy
        copy(given / name, tmp_path / name)
    for name in ("own-finger", "before", "after"):
        shutil.copytree(given / "my-finger", tmp_path / name)
    monkeypatch.chdir(tmp_path)
    matplotlib.use("Agg")
    # The same calls on fewer touches and elements: a page takes seconds, not minutes.
    monkeypatch.setattr(FingerDesign.__init__, "__defaults__", tuple(SMALL.values()))
    names: dict[str, Any] = {"touches": bayestouch.load_dataset("my-finger").touches}
    for language, text in found:
        if language == "toml":
            tomllib.loads(text)
        elif language == "console":
            run_commands(text)
        else:
            exec(compile(text, page, "exec", dont_inherit=True), names)


def test_pages_that_are_followed_in_one_folder_do_not_write_over_each_other() -> None:
    """The tutorial wrote touches of a channel over those of the finger, which other pages read."""
    written = {
        page: {
            name
            for language, text in blocks(ROOT / "docs" / f"{page}.md")
            if language == "console"
            for name in re.findall(r"(?:init| -o| --plot) (\S+)", text)
        }
        for page in ("quickstart", "calibrate_your_own", "tutorial")
    }
    assert {"my-finger", "calibration.nc", "posterior.nc"} <= written["quickstart"]
    assert "own-finger" in written["calibrate_your_own"] and "channel-posterior.nc" in written["tutorial"]
    names = [name for each in written.values() for name in each]
    assert len(names) == len(set(names))


def test_no_page_with_a_block_is_left_out() -> None:
    assert [page for page in PAGES if page not in WITH_BLOCKS and blocks(ROOT / page)] == []


def test_api_page_lists_the_public_names() -> None:
    text = (ROOT / "docs" / "api.md").read_text("utf-8")
    listed = re.findall(r"^\.\. auto\w+:: bayestouch\.(\w+)$", text, re.MULTILINE)
    assert sorted(listed) == bayestouch.__all__


def test_public_names_are_typed_and_documented() -> None:
    import inspect

    for name in bayestouch.__all__:
        each = getattr(bayestouch, name)
        assert (each.__doc__ or "").strip(), name
        if inspect.isfunction(each):
            signature = inspect.signature(each)
            bare = [p.name for p in signature.parameters.values() if p.annotation is inspect.Parameter.empty]
            assert not bare and signature.return_annotation is not inspect.Signature.empty, name


def run_notebook(name: str, folder: Path) -> tuple[str, int]:
    """What a notebook prints, and how many pictures it shows, run in a folder."""
    nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed (extra dev)")
    nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed (extra dev)")
    pytest.importorskip("ipykernel", reason="ipykernel is not installed (extra dev)")
    notebook = nbformat.read(ROOT / "docs" / "notebooks" / f"{name}.ipynb", as_version=4)
    stored = [cell for cell in notebook.cells if cell.get("outputs") or cell.get("execution_count")]
    assert not stored, "outputs are made when the pages are built; clear them"
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    printed = "".join(output.get("text", "") for output in outputs)
    return printed, sum("image/png" in output.get("data", {}) for output in outputs)


def test_first_notebook_runs(tmp_path: Path) -> None:
    printed, pictures = run_notebook("first_look", tmp_path)
    inside = re.search(r"^(\d+) % of (\d+) touches are inside their 90 % interval", printed, re.MULTILINE)
    assert inside and pictures >= 3
    # three standard errors of a share of 90 %, if touches were independent
    assert abs(int(inside[1]) - 90) < 300 * (0.9 * 0.1 / int(inside[2])) ** 0.5


@pytest.mark.slow
def test_notebook_that_closes_the_loop_runs(tmp_path: Path) -> None:
    printed, pictures = run_notebook("close_the_loop", tmp_path)
    assert printed.startswith("Explained:") and "Found crosstalk" in printed and pictures >= 2
    before, after = (float(each) for each in re.findall(r"rms error of R (\d\.\d+) mm$", printed, re.MULTILINE))
    assert after < 0.75 * before
    assert (tmp_path / "calibration_after.nc").is_file()


@pytest.mark.slow
def test_notebook_of_posteriors_runs(given: Path, tmp_path: Path) -> None:
    (tmp_path / "posterior.nc").write_bytes((given / "posterior.nc").read_bytes())
    printed, pictures = run_notebook("read_posteriors", tmp_path)
    answer = re.search(r"sharper than 2 mm with probability (\d\.\d+)", printed)
    assert answer and 0 <= float(answer[1]) <= 1
    # tips on either side of the question get answers on either side
    shares = dict(re.findall(r"tip of +([\d.]+|inf) mm: mean probability ([\d.]+)", printed))
    assert float(shares["0.00"]) > 0.9 > 0.1 > float(shares["12.30"])
    assert pictures >= 3


def test_measured_errors_in_the_readme_are_those_of_the_tutorial() -> None:
    """`studies/tutorial.py --docs` prints them by the commands that the README names."""
    readme = " ".join((ROOT / "README.md").read_text("utf-8").split())
    printed = " ".join((ROOT / RUN_BY_A_STUDY).read_text("utf-8").split())
    for command in ("bayestouch example fluid-oil-1.5 -o channel", "bayestouch diagnose channel -o channel-diagnosis"):
        assert f"`{command}`" in readme and f"$ {command} " in printed
    (touches,) = re.findall(r"On (\d+) held-out touches", printed)
    assert f"| {touches} touches that no fit has seen |" in readme
    for row, pattern in (
        ("error of the location, rms", r"rms error of the location ([\d.]+) → ([\d.]+) (mm)"),
        ("error of the load, read without the force sensor, rms", r"force sensor, ([\d.]+) → ([\d.]+) (N)"),
        (
            "touches whose 90 % region contains the true place (best: 90 %)",
            r"coverage of 90 % intervals (\d+) → (\d+) (%)",
        ),
    ):
        ((before, after, unit),) = re.findall(pattern, printed)
        assert f"| {row} | {before} {unit} | {after} {unit} |" in readme
    assert "Partly explained:" in printed and 'the verdict is "partly explained"' in readme
    assert "distinguish it from gain_drift" in printed and "A drift of the gain explains" in readme


def test_every_page_is_in_one_list_of_the_first_page() -> None:
    """Tutorials, how-to, reference and explanation: each page is of one kind, and none is left out."""
    first = (ROOT / "docs" / "index.md").read_text("utf-8")
    lists = re.findall(r"^```\{toctree\}\n(.*?)^```", first, re.MULTILINE | re.DOTALL)
    listed = [line for each in lists for line in each.splitlines() if line and not line.startswith(":")]
    folder = ROOT / "docs"
    pages = [*folder.glob("*.md"), *folder.glob("notebooks/*.ipynb")]
    wanted = [page.relative_to(folder).with_suffix("").as_posix() for page in pages if page.name != "index.md"]
    assert sorted(listed) == sorted(wanted)
    captions = re.findall(r'^:caption: "?(\w+)', first, re.MULTILINE)
    assert captions == ["Tutorials", "How", "Reference", "Explanation", "Explanation"]
