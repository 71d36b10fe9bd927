"""How Sphinx builds the site; `make docs` runs it on a copy of this folder, in which it also writes."""

from __future__ import annotations

import os
import sys
from functools import partialmethod
from pathlib import Path

import click
import typer.main
from nbclient import NotebookClient

import fluorspar
from fluorspar.cli.main import app

project = "Fluorspar"
author = "The Fluorspar developers"
copyright = author
version = release = fluorspar.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_design",
    "sphinx_copybutton",
]
exclude_patterns = ["_templates", "ipython"]
templates_path = ["_templates"]

# Pages: Markdown that reads as well where nothing builds it
myst_enable_extensions = ["attrs_block", "colon_fence"]
myst_heading_anchors = 3
copybutton_exclude = ".linenos, .gp, .go"

# Tutorials and gallery are run when they are read: an error in a cell is one of the build
nb_execution_mode = "force"
nb_execution_timeout = 600
nb_execution_show_tb = True
nb_execution_in_temp = True
nb_output_stderr = "remove"  # progress, and what is compiled once
nb_merge_streams = True
# what a command prints arrives in pieces of 100 bytes, which MyST-NB would put on lines of their own
NotebookClient.__init__ = partialmethod(NotebookClient.__init__, coalesce_streams=True)
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"  # `fluorspar` in cells
os.environ |= {
    "COLUMNS": "80",
    "TTY_COMPATIBLE": "0",
    "NO_COLOR": "1",
}  # cells are no terminal, whatever Jupyter says

SETTINGS = Path(__file__).parent / "ipython"  # in place of the user's own, whatever these are
os.environ["IPYTHONDIR"] = str(SETTINGS)
(SETTINGS / "profile_default").mkdir(parents=True, exist_ok=True)
(SETTINGS / "profile_default" / "ipython_kernel_config.py").write_text(
    "c.IPKernelApp.log_level = 40  # errors\n"
)

# Reference, of the docstrings
autosummary_filename_map = {
    "fluorspar.material": "fluorspar.material-of-the-library"
}  # not fluorspar.Material
autodoc_typehints = "none"  # the docstrings say it in words
autodoc_member_order = "bysource"
numpydoc_show_class_members = False  # the template lists them
default_role = "py:obj"
add_module_names = False

html_theme = "pydata_sphinx_theme"
html_title = "Fluorspar"
html_favicon = str(Path(fluorspar.__file__).parent / "view" / "static" / "icon.svg")
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_theme_options = {
    "logo": {"text": "Fluorspar", "image_light": html_favicon, "image_dark": html_favicon},
    "navbar_end": ["theme-switcher"],
    "show_prev_next": False,
    "footer_start": ["copyright"],
    "footer_end": [],
    "secondary_sidebar_items": ["page-toc"],
}
html_sidebars = {"index": [], "gallery": []}


def write_commands(path: Path) -> None:
    """Write the page of the command line: the help of every command, as it prints it."""
    sections = ["# Command line", "What `--help` prints, of every command."]

    def add(command: click.Command, name: str, parent: click.Context | None) -> None:
        context = command.make_context(name, [], parent, resilient_parsing=True, terminal_width=78)
        sections.append(f"## {context.command_path}\n\n```text\n{command.get_help(context)}\n```")
        for child in getattr(command, "commands", {}):
            add(command.commands[child], child, context)

    add(typer.main.get_command(app), "fluorspar", None)
    path.write_text("\n\n".join(sections) + "\n", "utf-8")


write_commands(Path(__file__).parent / "commands.md")
