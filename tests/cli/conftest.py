from small_library import (  # noqa: F401 - fixtures
    small_corpus,
    small_corpus_template,
    small_library,
    small_library_template,
)
