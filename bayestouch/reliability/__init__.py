"""Reliability of a finger's readings over location: thresholds, sweet spots, and effects of the design.

``__init__.pyi`` lists the module of each name; a module is imported when one of its names is used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
