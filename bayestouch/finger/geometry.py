"""Geometry of fingers. The class is in `bayestouch.data`, because contacts, effects and tables use it too."""

from __future__ import annotations

from bayestouch.data.finger import Finger

GEOMETRY = Finger
