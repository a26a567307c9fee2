"""The script that repeats a diagnosis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import bayestouch

if TYPE_CHECKING:
    from bayestouch.diagnosis.result import Diagnosis

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


def repeat_script(diagnosis: Diagnosis) -> str:
    """A script that makes the same diagnosis anew and saves it."""
    options = ", ".join(f"{name}={value!r}" for name, value in diagnosis.options.items())
    return _SCRIPT.format(version=bayestouch.__version__, options=options)
