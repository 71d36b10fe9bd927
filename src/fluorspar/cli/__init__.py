"""The command line, `fluorspar`: one module for each command."""
