"""The effects of the blind study (`studies/blind_study.py`): new forms of listed effects, and new unlisted causes.

They were written from what sensors do, before the code that they examine was frozen. No formula here is one of
`dataset.EFFECTS`, which `tests/simulator/test_blind_forms.py` checks, nor of `catalogue_forms`, by reading. They have a
registry of their own, so that studies of today draw the same fingers as before. Whether the catalogue can take on a
form is left open: `Effect.in_catalogue` means nothing here.
"""

from __future__ import annotations

from . import blind_elements, blind_errors, blind_readout, blind_rig, blind_unlisted

LISTED = blind_rig.EFFECTS + blind_elements.EFFECTS + blind_readout.EFFECTS + blind_errors.EFFECTS
UNLISTED = blind_unlisted.EFFECTS
EFFECTS = {effect.key: effect for effect in LISTED + UNLISTED}
