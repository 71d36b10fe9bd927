"""What is too large is refused before it is read."""

from __future__ import annotations

import pytest

from fluorspar.errors import ImageError
from fluorspar.files.memory import available_memory, check_memory


def test_only_what_is_larger_than_what_is_free_is_refused() -> None:
    check_memory(available_memory() // 2, "a.nc", "half of it")
    with pytest.raises(ImageError, match=r"(?s)does not fit.*a\.nc.*a lot: 1,000,000 GB.*at most"):
        check_memory(10**15, "a.nc", "a lot")
