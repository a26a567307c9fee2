"""Script that repeats a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bayestouch.version import __version__

_SCRIPT = '''\
"""Repeat this diagnosis: python repeat.py DATASET NEW_FOLDER"""

import sys

import bayestouch

# Made with bayestouch {version}.
dataset, folder = sys.argv[1:]
diagnosis = bayestouch.diagnose(bayestouch.load_dataset(dataset), {options})
diagnosis.save(folder)
print(diagnosis)
'''


def repeat_script(options: Mapping[str, Any]) -> str:
    """Text of a script that repeats the diagnosis with these options and saves it."""
    # `.item` of a NumPy number: its text would need NumPy's name.
    plain = {name: value.item() if isinstance(value, np.generic) else value for name, value in options.items()}
    named = ", ".join(f"{name}={value!r}" for name, value in plain.items())
    return _SCRIPT.format(version=__version__, options=named)
