"""Studies as modules, for the tests that run them."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

STUDIES = Path(__file__).parents[1] / "studies"
PAPER = STUDIES / "nicolson_fearing"
#: Studies that can be run, by their paths below studies/ without the ending.
SCRIPTS = sorted(
    path.relative_to(STUDIES).with_suffix("").as_posix()
    for folder in (STUDIES, PAPER)
    for path in folder.glob("[!_]*.py")
    if '__name__ == "__main__"' in path.read_text("utf-8")
)
# Studies import each other and small modules of their own.
sys.path += [str(folder) for folder in (STUDIES, PAPER) if str(folder) not in sys.path]


def study(name: str) -> ModuleType:
    """A study as a module, by its path below studies/ without the ending."""
    path = STUDIES / f"{name}.py"
    spec = importlib.util.spec_from_file_location(f"study_{name.replace('/', '_')}", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def agree(made: str, printed: str) -> bool:
    """Whether two texts differ by one in the last digit of their numbers at most, which another processor may round."""
    number = re.compile(r"[+-]?\d+(?:\.\d+)?")
    ours, theirs = number.findall(made), number.findall(printed)
    return number.sub("#", made) == number.sub("#", printed) and all(
        abs(float(one) - float(other)) < 1.5 * 10.0 ** -len(other.partition(".")[2])
        for one, other in zip(ours, theirs, strict=True)
    )


def is_drawn(path: Path) -> bool:
    """Whether a picture is large enough to be looked at, and not empty: axes with their labels are 2.2 % of ink."""
    from PIL import Image

    picture = Image.open(path).convert("L")
    ink = sum(picture.histogram()[:200]) / (picture.width * picture.height)
    return picture.width > 600 and picture.height > 250 and ink > 0.025
