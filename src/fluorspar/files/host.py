"""The name of this machine, as part of the names of files that only it may remove."""

from __future__ import annotations

import platform
import re
import zlib

__all__ = ["HOST"]

_MOST = 32  # characters, of which 8 tell names apart that are cut or changed


def _short(node: str) -> str:
    """Letters, digits and underscores only.

    Examples
    --------
    >>> _short("studio"), _short("node-17")
    ('studio', 'node_17_9178f4fb')
    """
    plain = re.sub(r"\W", "_", node, flags=re.ASCII)
    if node and plain == node and len(node) <= _MOST:
        return node
    return f"{plain[: _MOST - 9]}_{zlib.crc32(node.encode(errors='surrogateescape')):08x}"


HOST = _short(platform.node())
