"""Which code gave a result of `error_rates`: no page holds results of two versions."""

from __future__ import annotations

import hashlib
from functools import cache
from pathlib import Path
from typing import Any

import independent

import bayestouch

Record = dict[str, Any]

#: Results from before versions were recorded.
UNKNOWN = "unknown"


@cache
def code_version() -> str:
    """Version of the package, and the start of a hash of the sources of the package and of the simulator.

    The hash stands for a commit: it works where there is no git, and a change that is not committed changes it, too.
    """
    folders = (Path(module.__file__ or "").parent for module in (bayestouch, independent))
    return f"{bayestouch.__version__}+{source_hash(*folders)}"


def source_hash(*folders: Path) -> str:
    """Start of a hash of all Python sources in these folders, with their names."""
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:10]


def version_of(record: Record) -> str:
    """Version of the code that gave a result."""
    return str(record.get("version", UNKNOWN))


def newest(records: list[Record]) -> list[Record]:
    """Results of the version that gave the last one; of each case the last result."""
    if not records:
        return []
    version = version_of(records[-1])
    return list({record["key"]: record for record in records if version_of(record) == version}.values())


def the_version(records: list[Record]) -> str:
    """The one version that all results have.

    Raises
    ------
    ValueError
        There are results of several versions, or none.
    """
    versions = sorted({version_of(record) for record in records})
    if len(versions) != 1:
        raise ValueError(f"expected results of one version of the code, got {', '.join(versions) or 'none'}")
    return versions[0]
