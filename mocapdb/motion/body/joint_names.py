"""What the name of a joint says: which part of the body, and which side.

`parse_name`        a name in one of the spellings of many programs -> side, word, number
`rank`              how well a word names a part of the body
`across_by_names`   for each of many names the one that is alike but for its side
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.resources import files

import numpy as np

from mocapdb.base.arrays import IntArray

__all__ = ["LIMB_PARTS", "JointName", "across_by_names", "parse_name", "rank"]

LIMB_PARTS = ("hip", "knee", "ankle", "toe", "shoulder", "elbow", "wrist")
"""The parts that a body has on either side."""

WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+|[^\W\d_]+")
NAMESPACE = re.compile(r".*[:|]")


@dataclass(frozen=True)
class JointName:
    """A joint's name, taken apart.

    Attributes
    ----------
    side : {"", "left", "right"}
    word : str
        What is named, in lower case and without separators; empty where it is no part that counts
        (a finger, a twist bone, the end of a chain).
    number : int
        The number in the name, 0 where there is none.
    """

    side: str
    word: str
    number: int


@cache
def _words() -> dict[str, dict[str, list[list[str]]]]:
    text = files(__package__).joinpath("joint_words.toml").read_text("utf-8")
    return tomllib.loads(text)


@cache
def _sets() -> tuple[dict[str, str], frozenset[str], frozenset[str], frozenset[str]]:
    """Return the side of each word for a side, the words of parts, noise, and of other things."""
    table = _words()
    sides = {str(word): side for side, words in table["sides"].items() for word in words}
    parts = [rows for kind in ("limbs", "middle") for rows in table[kind].values()]
    known = frozenset(word for rows in parts for row in rows for word in row)
    noise, other = (frozenset(map(str, table[kind]["words"])) for kind in ("noise", "other"))
    return sides, known, noise, other


def rank(part: str, word: str) -> int | None:
    """Return in which row of a part's table a word stands, None where in none of them."""
    table = _words()
    rows = table["limbs"].get(part) or table["middle"][part]
    return next((i for i, row in enumerate(rows) if word in row), None)


@lru_cache(maxsize=4096)
def parse_name(name: str) -> JointName:
    """Take a joint's name apart.

    Examples
    --------
    >>> parse_name("mixamorig:LeftUpLeg")
    JointName(side='left', word='upleg', number=0)
    >>> parse_name("lShldr").side, parse_name("DEF-upper_arm.R.001").word
    ('left', 'upperarm')
    """
    sides, known, noise, other = _sets()
    side, number = "", 0
    is_link = NAMESPACE.sub("", name).startswith("__")  # Blender's links between bones apart
    words: list[str] = []
    for word in _cut(NAMESPACE.sub("", name)):
        if word.isdigit():
            number = int(word)
        elif word in sides and not side:
            side = sides[word]
        else:
            words.append(word)
    whole = "".join(words)
    if whole not in known:
        words = [word for word in words if word not in noise]
        whole = "".join(words)
    if is_link or (whole not in known and other & set(words)):
        whole = ""
    return JointName(side, whole, number)


def across_by_names(names: Sequence[str]) -> IntArray:
    """Return for each joint the index of the one on the other side, or its own where none is.

    Names pair that are the same but for the words of their sides, whatever these name: fingers
    and the ends of chains too.

    Parameters
    ----------
    names : sequence of str

    Returns
    -------
    (J,) int

    Examples
    --------
    >>> across_by_names(["hips", "LeftFoot", "thigh_l", "RightFoot", "thigh_r"]).tolist()
    [0, 3, 4, 1, 2]
    """
    sides = _sets()[0]
    index: dict[tuple[str, tuple[str, ...]], int] = {}
    keys = []
    for joint, name in enumerate(names):
        words = _cut(NAMESPACE.sub("", name))
        at = next((i for i, word in enumerate(words) if word in sides), None)
        side = "" if at is None else sides[words[at]]
        rest = tuple(word for i, word in enumerate(words) if i != at)
        keys.append((side, rest))
        index.setdefault((side, rest), joint)
    other = {"left": "right", "right": "left", "": ""}
    return np.array(
        [
            index.get((other[side], rest), joint) if side else joint
            for joint, (side, rest) in enumerate(keys)
        ]
    )


def _cut(name: str) -> list[str]:
    """Cut a name into words in lower case, sides apart."""
    words: list[str] = []
    for found in WORD.findall(name):
        word = found.lower()
        words.extend([word] if _is_word(word) else _parted(word, found.isupper()))
    return words


def _is_word(word: str) -> bool:
    sides, known, noise, other = _sets()
    return word.isdigit() or word in sides or word in known or word in noise or word in other


def _parted(word: str, is_upper: bool) -> list[str]:
    """Cut a word without capitals into a side and a known word, if it is made of these."""
    sides, known, _, other = _sets()
    for beginning in sides:
        rest = word.removeprefix(beginning)
        if rest != word and (rest in known or rest in other or (is_upper and len(word) < 4)):
            return [beginning, rest]
    for end in sides:
        rest = word.removesuffix(end)
        if rest != word and rest in known and len(end) > 1:
            return [rest, end]
    return [word]
