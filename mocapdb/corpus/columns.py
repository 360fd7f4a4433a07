"""Further columns of label files, manifests and names: which names they may have.

What else is known of a clip (style, take, actor, session) is kept in columns of any name, but for
the names that a library has for columns of its own.
"""

from __future__ import annotations

import re

from mocapdb.errors import CorpusError

__all__ = ["RESERVED", "check_column"]

RESERVED = frozenset({
    "id", "clip", "name", "stem", "path", "class", "source", "corpus", "label_source",
    "skeleton_id", "n_channels", "frames", "seconds", "duration_s", "fps", "fps_source",
    "unit_m", "unit_source", "unit_m_source", "up", "up_source", "height_m",
    "frame_time_text", "provenance", "source_bytes", "source_sha256", "sha256", "settings",
    "codec", "payload_bytes", "bytes_per_frame", "skinned_error", "error_mm", "error_mean_mm",
    "error_p95_mm", "error_max_mm", "shard_id", "shard_row", "build_id", "deleted",
    "subject_source", "body", "columns", "unsearchable",
})  # fmt: skip
"""Names that the catalogue, and what is printed of it, have for something else."""
SAID = frozenset({"label", "subject", "description"})
"""Names of what a label file says of a clip: a further column that is spelt so is meant as one."""
PLAIN = re.compile(r"[^\W\d][\w .-]{0,63}")


def check_column(name: str) -> None:
    """Refuse a name that no further column may have.

    Raises
    ------
    CorpusError
        If a library has a column of that name, or it is no plain name.
    """
    if name.lower() in RESERVED:
        raise CorpusError(
            f"Expected names that a library does not use itself, but got {name!r}, which is "
            "reserved. Rename it."
        )
    if name not in SAID and name.lower() in SAID:
        raise CorpusError(f"Expected {name.lower()!r} in small letters, but got {name!r}.")
    if not PLAIN.fullmatch(name):
        raise CorpusError(
            "Expected names of letters, digits, '_', '-', '.' and spaces that start with a "
            f"letter, but got {name!r}."
        )
