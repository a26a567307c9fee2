"""The effects of the second blind study (`studies/blind_study.py`): new forms of listed effects, new unlisted causes.

The first blind study is used for development since it was run. These forms were written after that, by a helper who
had not read the code of the effects and of the diagnosis nor their pages, but who knew the names of the effects and the
forms of the earlier studies. No formula is one of `blind_forms` or of `dataset.EFFECTS`, which
`tests/simulator/test_blind_forms.py` checks. `Effect.in_catalogue` means nothing here.
"""

from __future__ import annotations

from . import second_elements, second_errors, second_readout, second_rig, second_unlisted

LISTED = second_rig.EFFECTS + second_elements.EFFECTS + second_readout.EFFECTS + second_errors.EFFECTS
UNLISTED = second_unlisted.EFFECTS
EFFECTS = {effect.key: effect for effect in LISTED + UNLISTED}
