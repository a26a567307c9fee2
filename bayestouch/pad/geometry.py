"""Geometry of pads. The class is in `bayestouch.data`, because effects and tables use it too."""

from __future__ import annotations

from bayestouch.data.pad import Pad

GEOMETRY = Pad
