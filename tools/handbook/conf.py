"""Sphinx: pages in Markdown by MyST, C by Breathe from what Doxygen has read, Python by autodoc."""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import crunchbot  # noqa: E402
from handbook.docstrings import marked  # noqa: E402

project, author = "CrunchBot", "The CrunchBot contributors"
release = version = crunchbot.__version__
extensions = ["breathe", "myst_parser", "sphinx.ext.autodoc"]
include_patterns = ["index.rst", "api/**", "*.md", "**/*.md"]
exclude_patterns = [".*/**"]
html_theme = "furo"
html_title = "CrunchBot"
html_copy_source = False
smartquotes = False  # options have two dashes
toc_object_entries = False  # each page copies the contents of all: with objects a third of the processor's time
myst_heading_anchors = 6
highlight_language = "text"  # of code that names none: commands, pictures
myst_enable_extensions = ["deflist"]
breathe_projects = {"crunchbot": os.environ["HANDBOOK_XML"]}
breathe_default_project = "crunchbot"
breathe_domain_by_extension = {"h": "c"}
autodoc_default_options = {"members": True, "undoc-members": True, "show-inheritance": True, "ignore-module-all": True}
autodoc_member_order = "bysource"
autodoc_type_aliases = {"ArrayLike": "numpy.typing.ArrayLike"}
linkcheck_timeout = 20
# A struct and a function may have one name in C; Sphinx knows one space of names.
suppress_warnings = ["duplicate_declaration.c"]


def setup(app):
    app.connect("autodoc-process-docstring", mark)


def mark(app, what, name, found, options, lines):
    """Docstrings are plain text."""
    lines[:] = marked(lines)
