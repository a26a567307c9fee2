"""The script that repeats a diagnosis."""

from __future__ import annotations

import numpy as np

from bayestouch.diagnosis.repeat import repeat_script


def test_options_are_written_as_python_reads_them() -> None:
    """Also numbers of NumPy, whose own text needs a name that the script does not import."""
    script = repeat_script({"contact": "hertz", "draws": np.int64(500), "sample": True, "seed": np.uint8(3)})
    compile(script, "repeat.py", "exec")
    assert "contact='hertz', draws=500, sample=True, seed=3)" in script
