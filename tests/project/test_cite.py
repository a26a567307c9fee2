"""The page on how to cite, and `CITATION.cff`, which a program must be able to read."""

from __future__ import annotations

import re

import pytest
from committed import ROOT


def test_citation_file_is_complete_and_the_page_agrees() -> None:
    yaml = pytest.importorskip("yaml", reason="PyYAML is not installed (it comes with the extra docs)")
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    # the keys that version 1.2.0 of the format demands
    assert {"cff-version", "message", "title", "authors"} <= set(cited)
    assert cited["type"] == "software" and cited["license"] == "BSD-3-Clause"
    page = (ROOT / "docs" / "cite.md").read_text("utf-8")
    titles = re.findall(r"^  title +=\s+\{(.+)\},$", page, re.MULTILINE)
    (paper,) = cited["references"]
    assert titles == [cited["title"], paper["title"]]
    for author in paper["authors"]:
        assert f"{author['family-names']}, {author['given-names']}".rstrip(".")[:16] in page
    assert f"year   = {{{paper['year']}}}" in page


def test_the_page_names_the_key_of_the_version_in_a_report() -> None:
    # every report has these keys: tests/end_to_end/test_reports.py
    keys = (ROOT / "tests" / "end_to_end" / "report_keys_0.1.0.txt").read_text("utf-8").splitlines()
    named = re.findall(r"`report\.json` as `([\w.]+)`", (ROOT / "docs" / "cite.md").read_text("utf-8"))
    assert named == ["bayestouch.version"] and named[0] in keys
