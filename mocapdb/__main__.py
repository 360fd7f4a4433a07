"""``python -m mocapdb``."""

from mocapdb.cli import main

if __name__ == "__main__":
    main()
