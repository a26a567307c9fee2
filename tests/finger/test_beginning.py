"""Options that the fits of a finger with effects refuse."""

from __future__ import annotations

import pytest

from bayestouch.errors import InputError
from bayestouch.finger.beginning import begin


def test_an_identified_map_has_no_further_groups_beside_effects_either() -> None:
    """As without effects; nothing is fitted before."""
    with pytest.raises(InputError, match="have no likelihood of an identified E map"):
        begin(None, contact="layer", draws=8, seed=0, e_map="empirical", groups=("prior",))  # type: ignore[arg-type]
