"""What is warned of reaches who asked, whatever other threads do."""

from __future__ import annotations

import threading
import warnings

from fluorspar.errors import FluorsparWarning
from fluorspar.view.heard import heard


def test_others_are_not_heard() -> None:
    """Warnings of other threads and of other kinds go where they went, those before and after too."""
    with warnings.catch_warnings(record=True) as rest:
        warnings.simplefilter("always")
        warnings.warn("before", FluorsparWarning, stacklevel=1)
        with heard() as texts:
            thread = threading.Thread(target=warnings.warn, args=("another thread", FluorsparWarning))
            thread.start()
            thread.join()
            warnings.warn("another kind", UserWarning, stacklevel=1)
            warnings.warn("here", FluorsparWarning, stacklevel=1)
            warnings.warn("here", FluorsparWarning, stacklevel=1)
        warnings.warn("after", FluorsparWarning, stacklevel=1)
    assert texts == ["here"]
    assert [str(each.message) for each in rest] == ["before", "another thread", "another kind", "after"]


def test_a_filter_that_another_thread_left_does_not_matter() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FluorsparWarning)
        with heard() as texts:
            warnings.warn("here", FluorsparWarning, stacklevel=1)
    assert texts == ["here"]
