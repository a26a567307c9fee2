"""How often statements of a diagnosis were right in the blind study.

The probabilities of causes compare the models that were fitted. None of them may be right: a cause that no catalogue
has may resemble an effect, and so may an effect that follows another formula. How often this happens cannot be learned
from the touches. It was counted on 379 simulated fingers with new formulas and unlisted causes (docs/blind_study.md).
"""

from __future__ import annotations

# Number of statements that were right, and of all, by the verdict and the number of effects (2: two or more). A
# statement is right if it names the effects that were simulated and no others; "unattributed", if none is listed.
# tests/studies/test_blind_rates.py counts them again.
_RIGHT_AND_ALL = {
    ("adequate", 0): (102, 102),
    ("explained", 1): (58, 68),
    ("explained", 2): (8, 25),
    ("partly explained", 1): (28, 47),
    ("partly explained", 2): (13, 37),
    ("unattributed", 0): (76, 100),
}
_EFFECTS = ("no effect", "one effect", "two or more effects")


def right_in_blind_study(verdict: str, n_effects: int) -> tuple[int, int]:
    """Number of statements of this kind that were right in the blind study, and number of all of them."""
    return _RIGHT_AND_ALL.get((verdict, min(n_effects, 2)), (0, 0))


def blind_rate_sentence(verdict: str, n_effects: int) -> str:
    """Sentence on how often such statements were right; empty if there were none."""
    right, total = right_in_blind_study(verdict, n_effects)
    if not total:
        return ""
    kind = f"{verdict}, {_EFFECTS[min(n_effects, 2)]}"
    return f"In the blind study on simulated fingers, {right} of {total} statements of this kind ({kind}) were right."
