"""Answers are computed once for an object, and forgotten with it."""

import gc
import weakref

from mocapdb.base.kept_answers import kept_with_first


class Clip:
    """Something that can be asked about."""


def test_an_answer_is_kept_for_as_long_as_its_object_lives():
    asked = []

    @kept_with_first
    def answer(clip, what="", *, more=0):
        """Say what."""
        asked.append((what, more))
        return [what]

    one, other = Clip(), Clip()
    assert answer(one, "a", more=1) is answer(one, "a", more=1)
    assert answer(other, "b") == ["b"]
    assert asked == [("a", 1), ("b", 0)]
    assert answer.__doc__ == "Say what."
    gone = weakref.ref(one)
    del one
    gc.collect()
    assert gone() is None
    assert answer(Clip(), "c") == ["c"]
