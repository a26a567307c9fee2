"""The effects of the fifth blind study (`studies/blind_study.py`): new forms of listed effects, new unlisted causes.

The four earlier blind studies are used for development since they were run. These forms were written after that, by a
helper who had not read the code of the effects and of the diagnosis nor their pages, but who knew the names of the
effects, the earlier forms, and what `catalogue_forms` beside this file says of the catalogue's formulas. No formula is
one of `fourth_forms`, of `third_forms`, of `second_forms`, of `blind_forms` or of `dataset.EFFECTS`, which
`tests/simulator/test_blind_forms.py` checks. `Effect.in_catalogue` means nothing here.
"""

from __future__ import annotations

from . import fifth_elements, fifth_errors, fifth_readout, fifth_rig, fifth_unlisted

LISTED = fifth_rig.EFFECTS + fifth_elements.EFFECTS + fifth_readout.EFFECTS + fifth_errors.EFFECTS
UNLISTED = fifth_unlisted.EFFECTS
EFFECTS = {effect.key: effect for effect in LISTED + UNLISTED}
