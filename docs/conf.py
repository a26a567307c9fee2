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

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "numpydoc"]
myst_enable_extensions = ["amsmath", "deflist", "dollarmath"]
myst_heading_anchors = 3
numpydoc_show_class_members = False
autodoc_typehints = "none"  # numpydoc prints types from the docstrings
autodoc_member_order = "bysource"

# Notebooks are stored without outputs and run when the pages are built, so that outputs are those of this version.
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_timeout = 600
nb_execution_raise_on_error = True
nb_merge_streams = True

exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "bayestouch"
