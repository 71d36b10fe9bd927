"""The command `fluorspar`, and `python -m fluorspar` where it is not on the path."""

from __future__ import annotations

import sys

from fluorspar.cli.signals import Signals

__all__ = ["main"]


def main() -> None:
    """Run the command line; Ctrl-C is in order already while it is imported."""
    with Signals() as signals:
        try:
            from fluorspar.cli.main import main as run

            run()
        except KeyboardInterrupt:
            sys.exit(signals.exit_code)


if __name__ == "__main__":
    main()
