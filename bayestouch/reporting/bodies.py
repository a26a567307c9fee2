"""Bodies that have reports."""

from __future__ import annotations

from collections.abc import Mapping

from bayestouch.data.sensor import Finger, Pad
from bayestouch.reporting.body_pages import BodyPages
from bayestouch.reporting.finger.pages import FINGER
from bayestouch.reporting.pad.pages import PAD

#: Pages by the name of the body in ``sensor.toml`` and ``report.json``.
PAGES: Mapping[str, BodyPages] = {Finger.kind: FINGER, Pad.kind: PAD}
