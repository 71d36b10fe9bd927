"""What Mitsuba logs, as Python logs: by itself it prints on standard output, coloured, with any names a scene has."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

__all__ = ["renderer_log"]

_LOG = logging.getLogger(__name__)
_STAMP = re.compile(r"^[\d-]+ [\d:]+ [A-Z]+ +")


@contextmanager
def renderer_log() -> Iterator[None]:
    """Pass on what Mitsuba logs in the body of a `with` statement; a variant must be set.

    Examples
    --------
    >>> import mitsuba as mi
    >>> mi.set_variant("scalar_rgb")
    >>> with renderer_log():
    ...     scene = mi.load_dict({"type": "scene"})
    """
    import mitsuba as mi

    logger = mi.logger()
    before = [logger.appender(number) for number in range(logger.appender_count())]
    logger.clear_appenders()
    logger.add_appender(_appender())
    try:
        yield
    finally:
        logger.clear_appenders()
        for appender in before:
            logger.add_appender(appender)


@cache
def _appender() -> Any:
    import mitsuba as mi

    class Appender(mi.Appender):  # type: ignore[misc]
        def append(self, level: Any, text: str) -> None:
            known = {mi.LogLevel.Warn: logging.WARNING, mi.LogLevel.Error: logging.ERROR}
            _LOG.log(known.get(level, logging.DEBUG), "Mitsuba: %s", _STAMP.sub("", text))

        def log_progress(self, *_: Any) -> None:
            pass

    return Appender()
