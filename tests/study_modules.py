"""Studies as modules, for the tests that run them."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

STUDIES = Path(__file__).parents[1] / "studies"


def study(name: str) -> ModuleType:
    """A study as a module, by its path below studies/ without the ending."""
    if str(STUDIES) not in sys.path:  # studies import each other and small modules of their own
        sys.path.append(str(STUDIES))
    path = STUDIES / f"{name}.py"
    spec = importlib.util.spec_from_file_location(f"study_{name.replace('/', '_')}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module
