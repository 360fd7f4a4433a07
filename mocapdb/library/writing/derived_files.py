"""Files that are made from others: replaced whole, with their checksums in the catalogue."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from mocapdb.base.files import replacing
from mocapdb.errors import MocapdbError
from mocapdb.library.hdf5 import file_sha256, no_file
from mocapdb.library.writing.catalogue_writer import CatalogueWriter

__all__ = ["replacing_derived"]


@contextmanager
def replacing_derived(
    catalogue: CatalogueWriter, path: Path, failed: Callable[[Path, OSError], MocapdbError]
) -> Iterator[Path]:
    """Give a file that takes the place of a derived one at the end, and note its checksum.

    It is noted beside that of the file before, which goes only when the new one is in its place:
    killed at any moment, what is there has a checksum.
    """
    with replacing(path, failed=failed, one_writer=True) as (unfinished,):
        yield unfinished
        with catalogue.transaction():
            catalogue.add_derived(path.name, file_sha256(unfinished))
            if not path.exists():
                catalogue.add_derived(path.name, no_file(path.name))
    with catalogue.transaction():
        catalogue.keep_derived(path)
