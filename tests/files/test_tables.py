"""Text tables: what is accepted, and what each fault is called."""

from __future__ import annotations

import numpy as np
import pytest

from fluorspar.errors import MaterialError, SpectrumError
from fluorspar.files.tables import parse_table, read_table


@pytest.mark.parametrize(
    "text",
    [
        "400 0.5\n500 0.6",
        "400,0.5\n500,0.6",
        "400;0,5\n500;0,6",
        "400\t0.5\n500\t0.6\n",
        "# x\n400, 0.5,\n\n500 ,0.6",
    ],
    ids=[
        "blanks",
        "commas",
        "semicolons with decimal commas",
        "tabs",
        "comments, trailing commas, empty lines",
    ],
)
def test_separators(text: str) -> None:
    assert parse_table(text, where="file").numbers().tolist() == [[400, 0.5], [500, 0.6]]


def test_keys_and_header() -> None:
    text = "# name: a dye\n# Credit: first\n# credit: second\n# no key here\nnm,S\n400,1"
    table = parse_table(text, where="file")
    assert table.keys == {"name": "a dye", "credit": "first\nsecond"}
    assert table.header == ("nm", "S")


def test_the_corner_of_a_header_may_be_empty() -> None:
    table = parse_table(",400,500\n400,0.5,0.1\n", where="file")
    assert (table.header, table.rows) == (("", "400", "500"), [["400", "0.5", "0.1"]])


def test_nan_is_left_to_whoever_uses_the_table() -> None:
    assert np.isnan(parse_table("400 nan", where="file").numbers()[0, 1])


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("nm,S\n400,0.5\n500,x", "not a number(.|\n)*dye.csv, line 3(.|\n)*'x'"),
        ("400,0.5\n500", "number of cells(.|\n)*line 2(.|\n)*got: +1(.|\n)*expected: 2"),
        ("# nothing\nnm,S", "no rows"),
    ],
)
def test_faults_are_named_with_their_line(text: str, complaint: str) -> None:
    with pytest.raises(SpectrumError, match=complaint):
        parse_table(text, where="dye.csv").numbers()


def test_missing_and_binary_files(tmp_path) -> None:
    with pytest.raises(MaterialError, match="does not exist"):
        read_table(tmp_path / "no.csv", error=MaterialError)
    (tmp_path / "picture.csv").write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(SpectrumError, match="cannot be read as text"):
        read_table(tmp_path / "picture.csv")


def test_rows_with_names() -> None:
    """Names hold blanks, begin with # and, quoted or where something else separates the cells, hold any separator."""
    for text in (
        '# a comment\npoint,x,note\nleft wall,1,"a, b; c"\n#2,2,white; matte\n',
        "point\tx\tnote\nleft wall\t1\ta, b; c\n#2\t2\twhite; matte\n",
    ):
        table = parse_table(text, where="points.csv", named_rows=True)
        assert table.header == ("point", "x", "note")
        assert table.rows == [["left wall", "1", "a, b; c"], ["#2", "2", "white; matte"]]


def test_a_line_that_is_no_part_of_a_table() -> None:
    with pytest.raises(SpectrumError, match=r"(?s)not part of a table.*dump\.csv, line 2"):
        parse_table("a,b\n1," + 200_000 * "x", where="dump.csv")
