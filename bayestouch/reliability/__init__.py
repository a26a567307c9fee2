"""How far a finger's readings can be trusted, and where: thresholds, sweet spots, and questions of design.

``__init__.pyi`` says which module defines a name; the module is imported when the name is used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
