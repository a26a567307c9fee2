"""Simulated fingers for the tests and studies of the diagnosis. Imports nothing of bayestouch.

Own elasticity (`body`: collocation of the displacement equations), own contact (`contact`: piecewise linear
pressure on nodes), own effects in other functional forms than the package's catalogue (`rig`, `elements`,
`readout`, `errors`), and effects that no catalogue lists (`unlisted`). `finger` builds a data set and writes it,
`sizes` sets an effect to a wanted residual.
"""
