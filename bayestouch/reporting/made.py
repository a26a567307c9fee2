"""Versions with which a report was made, and the command that makes it again."""

from __future__ import annotations

import platform
import shlex
from importlib.metadata import PackageNotFoundError, version

from bayestouch.reporting.evidence import Evidence

_LIBRARIES = ("numpy", "scipy", "emcee", "xarray", "arviz", "matplotlib", "bokeh")


def versions(evidence: Evidence) -> dict[str, str]:
    """Versions of Python and of the libraries that compute numbers and figures."""
    found = {"Python": platform.python_version()}
    for name in (*_LIBRARIES, *(("scikit-learn",) if _has_baselines(evidence) else ())):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def command(evidence: Evidence) -> str:
    """Command that makes the report again, to be run next to the folders of the data set and of a saved diagnosis.

    A data set that was not read from a folder is called ``DATASET``.
    """
    path = evidence.dataset.path
    folder = "" if evidence.embedded else "DATASET" if path is None else path.resolve().name
    parts = ["bayestouch", "report", *([folder] if folder else []), "-o", "report", "--seed", str(evidence.seed)]
    parts += ["--draws", str(evidence.draws)]
    if evidence.plug_in:
        parts.append("--plug-in")
    if evidence.diagnosed is None:
        parts.append("--no-diagnosis")
    elif evidence.diagnosed.folder:
        parts += ["--diagnosis", evidence.diagnosed.folder]
    if _has_baselines(evidence):
        parts.append("--baselines")
    return shlex.join(parts)


def _has_baselines(evidence: Evidence) -> bool:
    return evidence.diagnosed is not None and "baselines" in evidence.diagnosed.numbers
