"""A journal that is cut off, or ends in rubbish, holds what was whole."""

from __future__ import annotations

import pytest

from fluorspar.files.journal import Journal, read_journal


@pytest.fixture
def written(tmp_path):
    path, ends = tmp_path / "a.journal", [0]
    with Journal(path) as journal:
        for number in range(3):
            journal.append({"number": number}, bytes([number]) * 5)
            ends.append(path.stat().st_size)
    return path, ends


def test_cut_off_anywhere(written):
    path, ends = written
    content = path.read_bytes()
    for length in range(len(content) + 1):
        path.write_bytes(content[:length])
        records = list(read_journal(path))
        whole = sum(end <= length for end in ends[1:])
        assert [said["number"] for said, _, _ in records] == list(range(whole))
        assert [data for _, data, _ in records] == [bytes([number]) * 5 for number in range(whole)]
        assert [end for _, _, end in records] == ends[1 : whole + 1]


@pytest.mark.parametrize("rubbish", [b"\0" * 100, b"\xff" * 100, bytes(range(7, 107))])
def test_ends_in_rubbish(written, rubbish):
    path, ends = written
    with path.open("ab") as file:
        file.write(rubbish)
    assert [end for _, _, end in read_journal(path)] == ends[1:]


def test_a_flipped_bit_is_noticed(written):
    path, ends = written
    content = bytearray(path.read_bytes())
    content[ends[1] + 20] ^= 1
    path.write_bytes(content)
    assert [end for _, _, end in read_journal(path)] == ends[1:2]


def test_goes_on_where_the_last_whole_record_ends(written):
    path, ends = written
    with path.open("ab") as file:
        file.write(b"half a rec")
    with Journal(path, ends[-1]) as journal:
        journal.append({"number": 3})
    assert [said["number"] for said, _, _ in read_journal(path)] == [0, 1, 2, 3]
