from small_library import small_corpus_template, small_library_template  # noqa: F401 - fixtures
