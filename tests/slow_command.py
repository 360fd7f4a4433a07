"""The ``mocapdb`` command that never gets done: ``python slow_command.py build CORPUS -o LIB``.

Commits after every clip and takes a minute for a BVH, so that a test may interrupt it on the way.
"""

from __future__ import annotations

import time

import mocapdb.library.building.commit_clips as committing
from mocapdb.cli import main
from mocapdb.library.building import encode_files

encode_file = encode_files._encode_file


def slowly(task, *settings):
    if task.path.endswith(".bvh"):
        time.sleep(60)
    return encode_file(task, *settings)


if __name__ == "__main__":
    committing.COMMIT_SECONDS = 0.0
    encode_files._encode_file = slowly
    main()
