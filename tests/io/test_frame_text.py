"""The kernel that reads numbers: every double the same as Python's ``float``."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mocapdb.io._frame_text import Pattern, read_frames
from mocapdb.io._text import Text


def read(text, n_channels=1, **pattern):
    data = text.encode() + b"\n"
    pattern = {"words": [b""], "columns": [range(n_channels)], **pattern}
    return read_frames(Text("x", data), 0, Pattern(**pattern), n_channels, text.count("\n") + 1)


def assert_same_as_float(words):
    found = read("\n".join(words))[:, 0]
    wanted = np.array([float(word) for word in words])
    assert found.tobytes() == wanted.tobytes()  # bit by bit, the sign of zero included


def test_numbers_of_the_corpus():
    assert_same_as_float(
        [
            "-6.6742e-014",
            ".0083333",
            "1.",
            "+3",
            "1e5",
            "-0",
            "0.0000",
            "-0.0",
            "4.65902e-18",
            "-1.87914E-16",
            "1E+05",
            "007",
        ]
    )


def test_numbers_at_the_edges():
    assert_same_as_float(
        [
            "9007199254740993",  # halfway between two doubles
            "9007199254740993.0000000000000000000000001",
            "123456789012345678901234567890",
            "1.7976931348623157e308",
            "5e-324",
            "2.2250738585072014e-308",
            "0e999999999999",
            "0." + "0" * 40 + "1",
            "1e-400",
            "8.5e-60",
            "999999999999999999e60",
        ]
    )


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=50))
def test_shortest_spelling_of_any_double(values):
    assert_same_as_float([repr(value) for value in values])


@given(
    st.lists(
        st.from_regex(
            r"[+-]?([0-9]{1,20}(\.[0-9]{0,20})?|\.[0-9]{1,20})([eE][+-]?[0-9]{1,2})?",
            fullmatch=True,
        ),
        min_size=1,
        max_size=20,
    )
)
def test_any_spelling_of_a_number(words):
    assert_same_as_float(words)


def test_more_hard_numbers_than_there_was_room_for():
    assert_same_as_float([f"1.{i:030d}1" for i in range(500)])


@pytest.mark.parametrize(
    "word",
    [
        *("nan", "NaN", "inf", "-inf", "1e999", "", ".", "-", "+", "1e", "1e+", "--1", "+-1"),
        *("1.2.3", "1-2", "0x10", "1_000", "1,5", "e5", "1e5.0", "1 2", "١"),
    ],
)
def test_what_is_no_finite_number_is_left_to_the_careful_reader(word):
    assert read(f"1\n{word}\n2" if word else "1 \n2 2") is None


def test_blank_lines_and_all_line_ends():
    text = "\n 1\t2 \r\n\n3 4\r\n  5   6"
    assert read(text, 2).tolist() == [[1, 2], [3, 4], [5, 6]]


def test_words_numbers_and_columns():
    pattern = {"words": [b"root", b"leg"], "columns": [[1, 2], [0]], "first_number": 7}
    text = "7\nroot 1 2\nleg 3\n8\n root 4 5\nleg 6 \n"
    assert read(text, 3, **pattern).tolist() == [[3, 1, 2], [6, 4, 5]]
    for wrong in [
        text.replace("8", "9"),
        text.replace("leg 6", "leg6"),
        text.replace("leg 6", "lag 6"),
        text.replace("leg 6", "legs 6"),
        text.replace("leg 6", "leg 6 7"),
        text.replace("leg 6", "leg"),
        text.replace("leg 6 \n", ""),
        text.replace("8\n", ""),
    ]:
        assert read(wrong, 3, **pattern) is None


def test_more_frames_than_there_can_be():
    data = b"1\n2\n3\n\n"
    pattern = Pattern([b""], [range(1)])
    assert read_frames(Text("x", data), 0, pattern, 1, 2) is None
    assert len(read_frames(Text("x", data), 0, pattern, 1, 3)) == 3
