"""The effects of the fourth blind study (`studies/blind_study.py`): new forms of listed effects, new unlisted causes.

The three earlier blind studies are used for development since they were run. These forms were written after that, by a
helper who had not read the code of the effects and of the diagnosis nor their pages, but who knew the names of the
effects, the earlier forms, and what `catalogue_forms` beside this file says of the catalogue's formulas. No formula is
one of `third_forms`, of `second_forms`, of `blind_forms` or of `dataset.EFFECTS`, which
`tests/simulator/test_blind_forms.py` checks. `Effect.in_catalogue` means nothing here.
"""

from __future__ import annotations

from . import fourth_elements, fourth_errors, fourth_readout, fourth_rig, fourth_unlisted

LISTED = fourth_rig.EFFECTS + fourth_elements.EFFECTS + fourth_readout.EFFECTS + fourth_errors.EFFECTS
UNLISTED = fourth_unlisted.EFFECTS
EFFECTS = {effect.key: effect for effect in LISTED + UNLISTED}
