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
        "400\t0,5\n500\t0,6\n",
        "400 0,5\n500 0,6\n",
    ],
    ids=[
        "blanks",
        "commas",
        "semicolons with decimal commas",
        "tabs",
        "comments, trailing commas, empty lines",
        "tabs with decimal commas",
        "blanks with decimal commas",
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


def test_titles_above_and_text_below_are_passed_over() -> None:
    text = (
        "A sheet, measured on 3 May\nslit,5 nm\n\nnm,S,T\n400,0.5,1\n500,0.6,2\n\nOperator,me,\nEnd of file"
    )
    table = parse_table(text, where="file")
    assert table.header == ("nm", "S", "T")
    assert table.rows == [["400", "0.5", "1"], ["500", "0.6", "2"]]
    assert table.lines == (4, 5, 6)


def test_names_that_are_not_enough_are_completed_by_the_line_above() -> None:
    table = parse_table("a,,b,\nnm,counts,nm,counts\n400,1,400,2", where="file")
    assert table.header == ("a nm", "a counts", "b nm", "b counts")


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("nm,S\n400,0.5\n4l0,0.6\n420,0.7", "line 3"),
        ("nm,S\n400,O.5\n410,0.6\n420,0.7", "line 2"),
        ("nm,S\n400,0.5\n410,0.6\n420,?", "line 4"),
        ("nm,S\n400,0.5\n410,0.6\n420,0.7,x", "line 4"),
        ("nm,S\n400,0.5\nsecond scan\n410,0.6", "line 3"),
    ],
)
def test_a_broken_row_is_no_text_around_the_table(text: str, line: str) -> None:
    with pytest.raises(SpectrumError, match=line):
        parse_table(text, where="file").numbers()


def test_empty_cells_are_nan_where_they_may_be() -> None:
    table = parse_table("nm,a,b\n400,,1\n500,2,", where="file")
    assert np.isnan(table.numbers(blanks=True)[0, 1])
    with pytest.raises(SpectrumError, match="line 2, cell 2"):
        table.numbers()


def test_text_that_is_not_utf_8(tmp_path) -> None:
    (tmp_path / "a.csv").write_bytes("slit 5 \xb5m\n400,1\n500,2".encode("latin-1"))
    assert len(read_table(tmp_path / "a.csv").rows) == 2
