"""The command line, `fluorspar`: one module for each command."""

from fluorspar.cli.main import main

__all__ = ["main"]
