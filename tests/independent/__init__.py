"""Simulated fingers for the tests and studies of the diagnosis. Imports nothing of bayestouch.

Own elasticity (`body`: collocation of the displacement equations), own contact (`contact`: piecewise linear
pressure on nodes), own effects (`rig`, `elements`, `readout`, `errors`), and effects that no catalogue lists
(`unlisted`). Some effects have a formula that the package's catalogue can take on, others have not: each `Effect` says
which, and `tests/simulator/test_forms.py` checks it. `finger` builds a data set and writes it,
`sizes` sets an effect to a wanted residual.
"""
