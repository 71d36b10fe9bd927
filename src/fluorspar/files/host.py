"""The name of this machine, as part of the names of files that only it may remove."""

from __future__ import annotations

import platform
import re

__all__ = ["HOST"]

HOST = re.sub(r"\W", "_", platform.node(), flags=re.ASCII)[:32] or "unnamed"
"""Letters, digits and underscores only."""
