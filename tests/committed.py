"""Files of the checkout, for tests of the project."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def committed_files() -> list[str]:
    try:
        listed = subprocess.run(
            ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
            cwd=ROOT,
            capture_output=True,
            check=True,
        )
    except (OSError, subprocess.CalledProcessError) as reason:
        pytest.skip(f"this is no git checkout, or git is absent: {reason}")
    return [name for name in listed.stdout.decode().split("\0") if name and (ROOT / name).is_file()]
