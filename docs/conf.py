"""Sphinx configuration; `make docs` builds with warnings as errors."""

from __future__ import annotations

import sys
from pathlib import Path

import bayestouch

# what serves the paper alone is documented, too
sys.path.append(str(Path(__file__).parents[1] / "studies"))

project = "bayestouch"
author = "The bayestouch developers"
version = release = bayestouch.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "numpydoc"]
myst_enable_extensions = ["amsmath", "dollarmath"]
myst_heading_anchors = 3
numpydoc_show_class_members = False
autodoc_typehints = "none"  # numpydoc prints types from the docstrings
autodoc_member_order = "bysource"

exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "bayestouch"
