"""Array types by what they hold. Shapes are in the docstrings."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
IndexArray = NDArray[np.intp]
BoolArray = NDArray[np.bool_]
ObjectArray = NDArray[Any]

#: A number, or an array with one number for each of several things.
FloatOrArray = float | FloatArray
