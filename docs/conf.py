"""Configuration of the documentation: ``sphinx-build -W -b html docs docs/_build``."""

from __future__ import annotations

import re
import sys
from importlib.metadata import version as installed
from pathlib import Path
from typing import Any

from gso import constraints

sys.path.insert(0, str(Path(__file__).parent))

project = "gso"
author = "The gso authors"
copyright = "The gso authors"
version = release = installed("gso")
language = "en"

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    # gallery.py beside this file
    "gallery",
]
exclude_patterns = ["_build"]
templates_path = ["_templates"]
# Ambiguous names of attributes in the types of parameters are no links.
suppress_warnings = ["ref.python"]
autosummary_generate = True
# Constraints are described on the page of their own package.
autosummary_context = {"elsewhere": ", ".join(constraints.__all__)}
autosummary_imported_members = True
autosummary_ignore_module_all = False
autodoc_member_order = "bysource"
autodoc_typehints = "none"
autodoc_default_options = {"members": True, "show-inheritance": True}
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_param = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = f"gso {release}"
html_static_path = ["static"]
html_css_files = ["gallery.css"]

# sphinx-build -b linkcheck docs docs/_build/links
linkcheck_timeout = 20
linkcheck_workers = 4
linkcheck_retries = 2
# The publisher answers programs with an error page.
linkcheck_ignore = [r"https://doi\.org/10\.1145/.*"]
# Anchors of pages that are built by scripts are not in their text.
linkcheck_anchors_ignore_for_url = [r"https://github\.com/.*"]


def _bars(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Escape the bars of absolute values, which are substitutions in reStructuredText."""
    for k, line in enumerate(lines):
        parts = re.split(r"(``.*?``)", line)
        parts[::2] = [re.sub(r"(?<!\\)\|", r"\|", part) for part in parts[::2]]
        lines[k] = "".join(parts)


def setup(app: Any) -> None:
    app.connect("autodoc-process-docstring", _bars)
