"""Would another rule name causes better? Rates of rules that decide by the figures of a diagnosis.

A rule that names fewer causes is wrong less often where the cause is in no catalogue, and finds fewer causes that are
in it. This study asks how far any rule can go: one that names the first effect from some probability on, and one that
is learned from other studies (a random forest of lack of fit before and after, probabilities, verdict and name of the
effect). Both only choose whether the first effect of a diagnosis is named. Counted are all single effects and unlisted
causes of the five blind studies, as those studies count them, with the results of the code that they froze. What is
learned is examined on the studies that it was not learned from.

    pip install 'bayestouch[baselines]'
    python studies/naming_rules.py [--docs]

`--docs` writes the table of docs/fifth_blind_study.md.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

from _blind_tables import found, is_counted, is_diagnosed, is_left_unnamed, is_named_first
from _page import DOCS, docs_of, markdown_table, put_into_page
from _result_lines import kept_lines
from blind_study import BLIND_STUDIES

Record = dict[str, Any]
#: Shares of unlisted causes that are to be left unnamed; of each rule the setting that names most is taken.
AIMS = (0.75, 0.8, 0.85, 0.9)
HEAD = ("rule", "unlisted: left unnamed", "one: named first", "studies apart: named first")
TREES, LEAF, SEED = 500, 5, 0


def records() -> list[Record]:
    """Single effects and unlisted causes of all five studies, with the name of their study.

    Whole fingers are counted apart, as on the pages of the studies, and a diagnosis that failed is wrong.
    """
    out = []
    for study in BLIND_STUDIES.values():
        lines = kept_lines(DOCS / "results" / study.name / "results.jsonl")
        out += [{**line, "study": study.name} for line in lines if line["kind"] in ("one", "unlisted")]
    return [record for record in out if is_diagnosed(record) and record["design"] == "small" and is_counted(record)]


def probability(record: Record) -> float:
    """Probability of the sets of causes that have the effect that was added first; 0 where none was."""
    first = found(record)[:1]
    return float(sum(each["probability"] for each in record["causes"] if first and first[0] in each["names"]))


def figures(record: Record, names: Sequence[str]) -> list[float]:
    """What the forest knows of a diagnosis; `names` are those of all effects."""
    before, after = (float(record[when]["lack_of_fit"]) for when in ("before", "after"))
    left = max(after - 1, 1e-3)
    said = [record["verdict"] == verdict for verdict in ("explained", "partly explained")]
    first = [name == found(record)[0] for name in names]
    fit = [np.log(before), np.log(after), np.log(left), left / max(before - 1, 0.05)]
    return [*fit, len(found(record)), probability(record), *said, record["in_place"] is not None, *first]


def learned(named: Sequence[Record]) -> list[float]:
    """Probability that the first effect of each diagnosis is right, by a forest that saw the other studies."""
    from sklearn.ensemble import RandomForestClassifier

    names = sorted({found(record)[0] for record in named})
    known = np.nan_to_num([figures(record, names) for record in named])
    right = np.array([is_right(record) for record in named])
    study, out = np.array([record["study"] for record in named]), np.zeros(len(named))
    for each in np.unique(study):
        forest = RandomForestClassifier(TREES, min_samples_leaf=LEAF, random_state=SEED)
        forest.fit(known[study != each], right[study != each])
        out[study == each] = forest.predict_proba(known[study == each])[:, 1]
    return list(map(float, out))


def is_right(record: Record) -> bool:
    """Whether the effect named first is there."""
    return record["kind"] == "one" and is_named_first(record)


def rates(of: Sequence[Record], score: dict[int, float], least: float) -> tuple[float, float]:
    """Shares of single effects named first and of unlisted causes left unnamed, if a score from `least` on names.

    `score` is that of the first effect, by the identity of the record; diagnoses without it have none to name.
    """
    one, unlisted = ([record for record in of if record["kind"] == kind] for kind in ("one", "unlisted"))
    hit = [is_right(record) and score[id(record)] >= least for record in one]
    # What the study counted as left unnamed stays so.
    left = [is_left_unnamed(record) or score.get(id(record), np.inf) < least for record in unlisted]
    return float(np.mean(hit)), float(np.mean(left))


def row_of(rule: str, of: Sequence[Record], score: dict[int, float], least: float) -> list[str]:
    """A row of the table."""
    named, left = rates(of, score, least)
    studies = {record["study"]: [each for each in of if each["study"] == record["study"]] for record in of}
    apart = [100 * rates(each, score, least)[0] for each in studies.values()]
    return [rule, f"{100 * left:.0f} %", f"{100 * named:.0f} %", f"{min(apart):.0f} to {max(apart):.0f} %"]


def main() -> list[list[str]]:
    """Print the table; returns its rows."""
    of = records()
    named = [record for record in of if found(record)]
    scores = {
        "probability": dict(zip(map(id, named), map(probability, named), strict=True)),
        "forest": dict(zip(map(id, named), learned(named), strict=True)),
    }
    rows = [row_of("as diagnosed", of, scores["probability"], 0.0)]
    for rule, score in scores.items():
        settings = sorted({0.0, *score.values()})
        for aim in AIMS:
            least = next(each for each in settings if rates(of, score, each)[1] >= aim)
            rows.append(row_of(f"{rule} from {least:.2f} on", of, score, least))
    kinds = [record["kind"] for record in of]
    print(f"{kinds.count('one')} single effects, {kinds.count('unlisted')} unlisted causes")
    print(markdown_table(HEAD, rows))
    return rows


if __name__ == "__main__":
    writes, others = docs_of(sys.argv[1:])
    if others:
        raise SystemExit(f"unknown: {' '.join(others)}")
    table = markdown_table(HEAD, main())
    if writes:
        put_into_page("naming_rules.py", table, DOCS / "fifth_blind_study.md")
