"""Checksums of the catalogue's rows."""

import sqlite3
import time

import pytest

from mocapdb.library import row_checksums


def test_an_interrupt_in_a_checksum_is_an_interrupt_and_the_row_is_right(monkeypatch):
    expected = row_checksums.row_checksum("a", 1)
    plain = row_checksums.row_checksum
    interrupts = [KeyboardInterrupt]

    def interrupted_once(*values):
        if interrupts:
            raise interrupts.pop()
        return plain(*values)

    monkeypatch.setattr(row_checksums, "row_checksum", interrupted_once)
    connection = sqlite3.connect(":memory:")
    row_checksums._register(connection)
    with pytest.raises(KeyboardInterrupt):  # it comes a moment after the statement
        ((checksum,),) = connection.execute("SELECT row_checksum('a', 1)").fetchall()
        assert checksum == expected
        time.sleep(30)
    connection.close()
