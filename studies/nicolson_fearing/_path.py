"""Scripts of this folder find what lies beside it, and the folder itself as a package: each imports this first."""

import sys
from pathlib import Path

STUDIES = Path(__file__).resolve().parents[1]
if str(STUDIES) not in sys.path:
    sys.path.append(str(STUDIES))
