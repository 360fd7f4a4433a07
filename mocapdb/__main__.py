"""``python -m mocapdb`` is the ``mocapdb`` command."""

from mocapdb.cli import main

main()
