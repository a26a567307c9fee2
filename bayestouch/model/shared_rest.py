"""Rest readings that touches share: which one each row of a data set has, and their errors as offsets of touches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayestouch.array_types import BoolArray, FloatArray, IntArray
from bayestouch.data.baseline import RestTally, rest_reads_of
from bayestouch.data.touches import Touches


@dataclass(frozen=True, eq=False)
class RestOffsets:
    """Errors of the rest readings that touches share, as offsets of their readings; t touches, m elements.

    Attributes
    ----------
    reads : (t, m) array
        Number of raw reads behind the rest reading that a touch shares; 0 if it shares none.
    removed : (t, m) array
        Estimate of the offset that was taken out of the mean readings.
    """

    reads: FloatArray
    removed: FloatArray

    def select(self, touches: BoolArray) -> RestOffsets:
        """The offsets of some touches."""
        return RestOffsets(self.reads[touches], self.removed[touches])


def shared_rest(*tables: Touches) -> tuple[IntArray, FloatArray]:
    """`SplitData.rest_source` and `SplitData.shared_reads` of tables before their rest readings are subtracted."""
    source, reads = [], np.zeros((2, tables[0].n_elements))
    for k, table in enumerate(tables):
        tally = RestTally.none(table.n_elements).after(table)
        reads[k] = rest_reads_of(tally, table)
        # A table without a reading at rest has that of the first one.
        shared = k if tally.rows else 0 if reads[0].any() else -1
        own = np.isin(table.touch, table.touch[~table.in_contact])
        source.append(np.where(own, -1, shared))
    return np.concatenate(source), reads
