"""Processor time of a study, with that of the processes that the package forks to use all cores."""

from __future__ import annotations

import os


def processor_seconds() -> float:
    """Seconds of processor so far, of this process and of those that it started and that have ended."""
    return sum(os.times()[:4])
