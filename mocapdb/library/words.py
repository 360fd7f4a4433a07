"""Finding clips by words: word starts, stems, and what else people call the same.

``walking`` finds ``walks`` (one stem), ``clim`` finds ``climbs`` (its start), and ``jog`` finds
``run``, after whatever has the word itself. The catalogue's own index of words knows starts only;
the stems of its vocabulary are found by SQLite's Porter stemmer, in tables that live as long as a
connection. There a word that is several, such as ``lieDownFloor`` or ``squat1Reps``, has the stems
of each.
"""

from __future__ import annotations

import re
import sqlite3
from typing import Final

__all__ = ["SYNONYMS", "clips_with_words"]

SYNONYMS: Final = (
    "jump hop leap bound",
    "run ran jog sprint dash",
    "walk stroll stride amble pace",
    "march parade",
    "sneak creep crept tiptoe prowl stealth",
    "stagger reel wobble sway drunk drunken tipsy",
    "limp hobble injured hurt wounded",
    "stumble trip fall fell tumble collapse",
    "crouch squat duck",
    "dodge evade avoid sidestep",
    "sideways sidestep strafe lateral",
    "backward backwards back reverse",
    "forward forwards ahead",
    "turn rotate pivot spin spun twirl",
    "sit sat seat seated chair",
    "stand stood idle wait still",
    "lie lay lying laid prone recline",
    "rise getup stand arise",
    "kneel knelt",
    "crawl",
    "climb ascend ladder",
    "stairs staircase steps upstairs downstairs",
    "punch box jab uppercut hook",
    "fight combat spar brawl",
    "kick",
    "karate martial judo taekwondo kungfu kata",
    "sword fence fencing blade slash",
    "throw threw toss hurl pitch lob",
    "catch caught grab grasp",
    "lift pick raise hoist",
    "carry hold bear",
    "push shove",
    "pull drag tug tow",
    "wave greet hello bye",
    "point indicate",
    "gesture gesticulate sign signal",
    "clap applaud",
    "bow curtsey",
    "handshake shake",
    "look glance watch gaze peer",
    "search seek",
    "talk speak conversation chat",
    "dance ballet salsa waltz",
    "cartwheel handspring somersault flip acrobatics tumbling",
    "stretch yoga warmup",
    "exercise workout training gymnastics",
    "basketball dribble",
    "soccer football",
    "golf putt",
    "swim swam stroke",
    "clean sweep swept mop wipe wash",
    "eat ate chew",
    "drink drank sip",
    "laugh giggle",
    "cry weep sob",
    "happy joyful cheerful glad",
    "sad depressed gloomy",
    "angry furious mad",
    "tired exhausted weary fatigued",
    "afraid scared fearful frightened",
    "proud confident",
    "old elderly aged senior",
    "young child kid childlike youthful",
    "feminine female woman womanly",
    "masculine male man manly",
    "fast quick rapid swift brisk",
    "slow slowly leisurely",
    "stop halt",
    "start begin",
    "rotation spin pirouette",
    "respond answer reply call phone telephone",
    "guide lead usher",
    "arm hand",
    "leg foot feet",
)
"""Words that people of the field use for the same: any of a line finds the others."""

SEVERAL = " OR ".join(
    f"{column} GLOB '{shape}'"
    for column in ("name", "label", "description")
    for shape in ("*[a-z][A-Z]*", "*[A-Za-z][0-9]*", "*[0-9][A-Za-z]*")
)
"""Of which clips some words may be several, in SQL."""

PARTS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[^\W\d_A-Z]+|\d+")
"""The parts of a word: ``lie``, ``Down`` and ``Floor``; ``squat``, ``1`` and ``Reps``."""

RANKS = "bm25(clips_fts, 2.0, 4.0, 1.0)"  # a class says more than a name, and that than a sentence


def clips_with_words(connection: sqlite3.Connection, text: str) -> dict[int, tuple[int, float]]:
    """Return the rows of clips that have every word of a text, and how well: lower is better.

    Deleted clips are among them.

    Parameters
    ----------
    connection : sqlite3.Connection
        To a catalogue.
    text : str

    Returns
    -------
    dict of int to (tier, rank)
        Tier 0 has the words themselves, their stems or beginnings, tier 1 other words for them.
    """
    words = re.sub(r'["\0]', " ", text).split()
    if not words:
        return {}
    _prepare(connection)
    plain, wide = [], []
    for word in words:
        # quoted, so that a name such as 07_01 or a dash is text and not query syntax
        own = [f'"{word}"*', *_terms(connection, [word])]
        others = _terms(connection, _synonyms(connection, word))
        plain.append(f"({' OR '.join(own)})")
        wide.append(f"({' OR '.join([*own, *others])})")
    found: dict[int, tuple[int, float]] = {}
    for tier, parts in enumerate((plain, wide)):
        rows = connection.execute(
            f"SELECT rowid, {RANKS} FROM clips_fts WHERE clips_fts MATCH ?", [" AND ".join(parts)]
        )
        for row, rank in rows:
            found.setdefault(int(row), (tier, float(rank)))
    return found


def _prepare(connection: sqlite3.Connection) -> None:
    """Make the tables of stems, once for a connection; the file itself is not written to."""
    if connection.execute("SELECT 1 FROM sqlite_temp_master WHERE name = 'stems'").fetchone():
        return
    (query_only,) = connection.execute("PRAGMA query_only").fetchone()
    connection.execute("PRAGMA query_only = OFF")  # which forbids temporary tables, too
    try:
        connection.execute(
            "CREATE VIRTUAL TABLE temp.vocabulary USING fts5vocab(main, clips_fts, row)"
        )
        for name, columns in (("synonyms", "words"), ("stems", "words, term UNINDEXED")):
            connection.execute(
                f"CREATE VIRTUAL TABLE temp.{name} USING "
                f"fts5({columns}, tokenize = 'porter unicode61')"
            )
        connection.executemany(
            "INSERT INTO temp.synonyms (words) VALUES (?)", [(line,) for line in SYNONYMS]
        )
        connection.execute(
            "INSERT INTO temp.stems (words, term) SELECT term, term FROM temp.vocabulary"
        )
        connection.executemany(
            "INSERT INTO temp.stems (words, term) VALUES (?, ?)", _several(connection)
        )
    finally:
        connection.execute(f"PRAGMA query_only = {query_only}")


def _several(connection: sqlite3.Connection) -> set[tuple[str, str]]:
    """Return the parts of each word of the clips that is several, and the word as it is indexed."""
    rows = connection.execute(f"SELECT name, label, description FROM clips WHERE {SEVERAL}")
    words = {word for row in rows for text in row for word in re.findall(r"[^\W_]+", text or "")}
    parts = {word: PARTS.findall(word) for word in words}
    return {(" ".join(own), word.lower()) for word, own in parts.items() if len(own) > 1}


def _terms(connection: sqlite3.Connection, words: list[str]) -> list[str]:
    """Return the words of the catalogue, quoted, that have the stem of one of some words.

    Or of which a part begins with one.
    """
    single = [word for word in words if word.isalnum()]
    if not single:
        return []
    quoted, starting = (" OR ".join(f'"{word}"{star}' for word in single) for star in ("", "*"))
    rows = connection.execute(
        "SELECT term FROM temp.stems WHERE stems MATCH ?1 "
        "UNION SELECT term FROM temp.stems WHERE stems MATCH ?2 AND words <> term",
        [quoted, starting],
    )
    return [f'"{term}"' for (term,) in rows]


def _synonyms(connection: sqlite3.Connection, word: str) -> list[str]:
    """Return the other words for a word in any of its forms."""
    if not word.isalnum():
        return []
    lines = connection.execute(
        "SELECT words FROM temp.synonyms WHERE synonyms MATCH ?", [f'"{word}"']
    )
    return [other for (line,) in lines for other in line.split()]
