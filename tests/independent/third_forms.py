"""The effects of the third blind study (`studies/blind_study.py`): new forms of listed effects, new unlisted causes.

The first and the second blind study are used for development since they were run. These forms were written after that,
by a helper who had not read the code of the effects and of the diagnosis nor their pages, but who knew the names of the
effects and the earlier forms. No formula is one of `second_forms`, of `blind_forms` or of `dataset.EFFECTS`, which
`tests/simulator/test_blind_forms.py` checks. `Effect.in_catalogue` means nothing here.
"""

from __future__ import annotations

from . import third_elements, third_errors, third_readout, third_rig, third_unlisted

LISTED = third_rig.EFFECTS + third_elements.EFFECTS + third_readout.EFFECTS + third_errors.EFFECTS
UNLISTED = third_unlisted.EFFECTS
EFFECTS = {effect.key: effect for effect in LISTED + UNLISTED}
