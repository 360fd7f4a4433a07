"""Fixtures of the small library."""

from small_library import (  # noqa: F401 - fixtures
    small_corpus_template,
    small_library_template,
)
