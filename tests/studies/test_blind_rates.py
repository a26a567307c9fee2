"""How often statements were right in the blind study, counted again from its results."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

from study_modules import study

from bayestouch.diagnosis.blind_rates import right_in_blind_study

study("causes")
import _cause_rules as rules  # noqa: E402  # beside the study, which puts its folder on the path

RESULTS = Path(__file__).parents[2] / "docs" / "results" / "blind_study" / "results.jsonl"


def test_counts_are_those_of_the_results() -> None:
    total: Counter[tuple[str, int]] = Counter()
    right: Counter[tuple[str, int]] = Counter()
    for record in map(json.loads, RESULTS.read_text("utf-8").splitlines()):
        if record.get("causes"):
            names = [each["name"] for each in record["effects_found"]]
            kind = (record["verdict"], min(len(names), 2))
            total[kind] += 1
            right[kind] += rules.right(rules.stated(names, record["verdict"]), record)
    assert sum(total.values()) == 379
    assert {kind: (right[kind], total[kind]) for kind in total} == {kind: right_in_blind_study(*kind) for kind in total}
