"""Protocol of the touch-table attributes that averages and baselines use, without an import of `Touches`; and reads."""

from __future__ import annotations

from typing import Any, Protocol, Self

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray


class SampleRows(Protocol):
    """Samples of touches, one row each; see `bayestouch.data.touches.Touches` for the attributes."""

    @property
    def touch(self) -> IntArray: ...
    @property
    def time_s(self) -> FloatArray: ...
    @property
    def indenter_radius_mm(self) -> FloatArray: ...
    @property
    def angle_deg(self) -> FloatArray | None: ...
    @property
    def x_mm(self) -> FloatArray | None: ...
    @property
    def y_mm(self) -> FloatArray | None: ...
    @property
    def load(self) -> FloatArray: ...
    @property
    def depth_mm(self) -> FloatArray: ...
    @property
    def readings(self) -> FloatArray: ...
    @property
    def readings_sd(self) -> FloatArray | None: ...
    @property
    def reads(self) -> FloatArray | None: ...
    @property
    def rest_reads(self) -> FloatArray | None: ...
    @property
    def notes(self) -> tuple[str, ...]: ...
    @property
    def n_rows(self) -> int: ...
    @property
    def n_elements(self) -> int: ...
    @property
    def in_contact(self) -> BoolArray: ...

    def with_(self, **changes: Any) -> Self:
        """Return a copy with other values of some attributes."""
        ...


def reads_of_rows(touches: SampleRows) -> FloatArray:
    """Number of raw reads behind each row, (n,): 1 where it is not stated."""
    if touches.reads is None:
        return np.ones(touches.n_rows)
    return np.where(np.isnan(touches.reads), 1.0, touches.reads)
