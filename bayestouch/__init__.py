"""How far a tactile sensor's readings can be trusted.

The verbs ``calibrate``, ``infer``, ``diagnose``, ``report`` and ``simulate``, and what they work on. ``__init__.pyi``
says which module defines a name; the module is imported when the name is used, so that ``import bayestouch`` stays
quick.
"""

import lazy_loader

from bayestouch.version import __version__ as __version__

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
