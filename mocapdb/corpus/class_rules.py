"""The classes of motion, and the rules that read a class off a description.

`CLASSES` lists the classes: a name and what belongs to it. `RULES` is an ordered table of word
patterns; the first that is found in a description decides. The rules were written for the index of
the CMU database, where a description is all that is known about a clip. ``docs/classes.md`` says
how the classes are meant and how many clips each holds.

A rule names what the whole clip is about, so the order runs from the particular to the general:
"playground - forward jumps" is playground, "run, leap" is run, "walk and carry" is carry.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Final

__all__ = ["CLASSES", "OTHER", "RULES", "UNKNOWN", "classify_description", "normalise_description"]

OTHER: Final = "other"
UNKNOWN: Final = "unknown"

CLASSES: Final[Mapping[str, str]] = MappingProxyType(
    {
        "acrobatics": "cartwheels, flips, handstands, rolls, stunt falls",
        "basketball": "dribbling, shooting, and the moves of a player",
        "box": "punches and boxing",
        "calibration": "poses and ranges of motion for the capture system, not motion for its own "
        "sake: T-pose, motorcycle pose",
        "carry": "picking up, lifting, carrying, setting down",
        "dance": "every dance but salsa",
        "eat": "eating, drinking, handling a cup",
        "emotion": "a mood acted out: laughing, crying, sad, shy",
        "evade": "ducking, dodging, standing on guard",
        "everyday": "everyday handling, often mimed: dressing, telephone, instruments, driving",
        "exercise": "stretching, squats, yoga, lunges",
        "gesture": "waving, pointing, bowing, signals, handshakes",
        "golf": "swing, putt, and the handling of tee and ball",
        "housework": "cleaning and cooking",
        "imitation": "a person imitates an animal or a character",
        "interaction": "two people captured together, whatever they do",
        "jump": "jumping, hopping, leaping, turning in the air",
        "lie": "lying down, rolling over, getting up from the ground",
        "look": "looking around, searching, poking",
        "martial arts": "kicks, karate, tai chi, attacks",
        "mixed": "a sequence of several unlike actions",
        "playground": "climbing, hanging and swinging on equipment, ladders and stools",
        "push": "pushing, pulling, dragging heavy things",
        "reach": "reaching for something",
        "run": "running and jogging, with what happens on the way",
        "salsa": "salsa",
        "sit": "sitting, sitting down, standing up from a seat",
        "sneak": "sneaking and creeping",
        "sport": "other sports with a ball or equipment: soccer, football, baseball, rowing",
        "stairs": "walking up and down stairs",
        "stand": "standing, waiting, balancing on the spot",
        "step": "single steps, sidesteps, stepping over and off things, turning on the spot",
        "story": "telling a story or a rhyme with the hands",
        "swim": "swimming strokes, in the air",
        "sword": "swordplay",
        "throw": "throwing and catching",
        "walk": "walking and marching in any style and direction",
        "work": "work with tools, in the workshop and the garden",
        OTHER: "described, but fits no class",
        UNKNOWN: "the index does not say what the clip shows",
    }
)

RULES: Final[tuple[tuple[str, str], ...]] = (
    (UNKNOWN, r"^(?:unknown|clean(?:ed)?|no movie|lost marker|bad amc|\d+ \d+\.amc)$"),
    (UNKNOWN, r"^movie and trial|^$"),
    ("interaction", r"subjects - subject [ab]"),
    ("mixed", r"vignettes|wash windows.*;|jumps kicks and punches"),
    (
        "mixed",
        r"^walk(?:ing)?(?: around)?, "
        r"(?:dragging|jumping|running|sit|sitting|squats|stretching|swinging)",
    ),
    ("salsa", r"salsa"),
    ("story", r"story|alaskan? vacation|nursery rhyme"),
    ("calibration", r"motor ?cycle|range of motion|t-?pose|calibration|^static pose"),
    ("imitation", r"human subject|mickey (?:cast|conducting|surprised)|superhero|alien"),
    (
        "imitation",
        r"^(?:airplane|bear|bird|cat|chicken|chip ?m[ou]nk|cow|devil|dog|elephant|fish"
        r"|gorilla|horse|monkey|mouse|panther|penguin|prairie dog|robot|snake|t-rex|tiger|zombie)$",
    ),
    ("dance", r"(?:break ?)?danc(?:e|ing)|charleston|lindy hop|moonwalk|ring around the ros\w+"),
    ("acrobatics", r"acrobatics|cartwheels?|(?:back|kick)?flips?|flp|somersault|summersult"),
    ("acrobatics", r"hand ?(?:springs?|stands?)|spin upside down|wide leg roll|helicopter"),
    ("acrobatics", r"(?:peel slip|pull fall|twists fall|fall on face)|ball (?:mount|walk)"),
    ("acrobatics", r"monkey sequence|(?:up right|long) sequence|fancy foot ?work"),
    ("sword", r"sword\w*"),
    ("gesture", r"(?:basketball|hand) signals|slap hands"),
    # Subjects 78 and 102 are one basketball session; its names for a move say no more than this.
    ("basketball", r"basketball|dribble|offensive move|defensive (?:left|move|right|straight)"),
    ("basketball", r"fake shot|feint (?:left|right)|pivoting"),
    ("basketball", r"(?:left|right|st?raight) drive"),
    ("basketball", r"^(?:left |right |super )(?:tight|wide) (?:left|right|turn)"),
    ("golf", r"^(?:swing|putt)$|placing (?:ball|tee)|picking up ball"),
    ("swim", r"swimming|(?:back|break|breast|fly) ?stroke|free ?style|butterfly"),
    ("sport", r"baseball|football|frisbee|soccer|rowing"),
    ("exercise", r"weight lifting|flexing"),
    ("throw", r"throw(?:ing)?|toss|catch|pitch"),
    ("martial arts", r"kick(?:ing|s)?|(?:left|right) blocks|tai chi|feign a few attacks"),
    ("martial arts", r"bassai|empi|gedanbarai|heiansyodan|mawashigeri|oiduki|syutouuke|yokogeri"),
    ("box", r"boxing|punch(?:es|ing)?"),
    ("run", r"run(?:ning)?|jog"),
    ("playground", r"playground|climb|ladder"),
    ("jump", r"jump(?:ing|s)?|hop|hopscotch|leap|^(?:90|180|270|360)"),
    ("stairs", r"stairs"),
    ("sneak", r"sneak(?:ing|y)?|creep(?:ing)?|stealthily|silent walk"),
    ("carry", r"carry|suitcase|[\d.]+ ?lbs?|pick(?:ing)?(?: \w+)? up|set down"),
    ("carry", r"bend, lift|lifting up|moving (?:a stool|heavy box)"),
    ("push", r"(?:drag|pull|push)(?:ing)?(?: on)? (?:heavy|object)|bang on high object"),
    ("sit", r"sit(?:ting)?|from chair"),
    ("lie", r"lay(?:ing)? down|get(?:ting)? up|roll over"),
    ("walk", r"walk(?:ing)?|wander|stride|navigate|pacing|follow path|limp(?:ing)?|march(?:ing)?"),
    ("walk", r"figure ?8s?|digital ?8|mummy ?8|quick little steps|lift legs high"),
    ("step", r"(?:side)?step(?:ping|s)?|turn in place|^turning$"),
    ("evade", r"avoid|duck(?:ing)?|guard pose|ready stance"),
    ("look", r"look(?:ing)?|search(?:ing)?|peeping|poking|investigating"),
    ("eat", r"(?:drink|eat|sip|chug)(?:ping|ging|ing)?|chug a beer|coffee mug|setting glass"),
    ("housework", r"(?:wash|clean)(?:ing)? windows?|washing|cleaning up|sweep(?:ing)?|mop"),
    ("housework", r"vacuuming|broom|dough|batter|onions|slicing|making coffee|sewing"),
    ("work", r"bolt|screwing|unscrewing|hammering|nail|hand saw|chopping wood|painting|coiling"),
    ("work", r"dig(?:ging)?|planting|rak(?:e|ing)|hanging(?: a)? picture"),
    ("everyday", r"phone|putting on|umbrella|(?:closing|opening) a box|moving and opening a box"),
    ("everyday", r"violin|drums?|drumming|piano|driving|fishing|gun|bow and arrow|typing|writing"),
    ("everyday", r"brushing teeth|combing|shaving|wash self|channel surfing|tv|palm pilot"),
    ("everyday", r"buying|paying|taking a movie|holding a baby|swing|swatting"),
    ("gesture", r"wav(?:e|ing)|direct traffic|giving directions|bow|curtsey|shrug|teaching"),
    ("gesture", r"peek ?a ?boo|high five|shak(?:e|ing) hands|hand shake"),
    ("exercise", r"stretch(?:es|ing)?|yoga|yawn|squats?|sun salutation|lunges"),
    ("reach", r"reach"),
    ("stand", r"stand(?:ing)?|wait(?:ing)?|idle|balance|shifting weight|thinker"),
    ("emotion", r"laugh(?:ing)?|crying|arguing|happy|sad|scared|upset|mope|depressed|elated|joy"),
    (
        "emotion",
        r"^(?:childish|clumsy|cold|cool|elderlyman|freezing|lavish|relaxed|rushed|sexy|shy)$",
    ),
)
"""Ordered ``(class, pattern)``: a pattern must be found as whole words of the normalised text."""


@cache
def _compiled_rules() -> tuple[tuple[str, re.Pattern[str]], ...]:
    return tuple((name, re.compile(rf"(?<!\w)(?:{pattern})(?!\w)")) for name, pattern in RULES)


def normalise_description(text: str) -> str:
    """Return a description as lower-case words: "JumpSmallForward" is "jump small forward".

    Words that are run together are split at capitals and before digits, underscores and odd white
    space become single spaces, and the note "CleanedGRS" that some descriptions end with is cut.
    """
    text = unicodedata.normalize("NFKC", text).replace("_", " ")
    text = re.sub(r"Cleaned\s*GRS\s*$", "", text, flags=re.IGNORECASE)
    text = re.sub(r"(?<=[a-z])(?=[A-Z]|\d)|(?<=\d)(?=[A-Z])", " ", text)
    return " ".join(text.lower().split())


def classify_description(text: str) -> str:
    """Return the class of `CLASSES` that a description speaks of.

    Parameters
    ----------
    text : str
        A description as in the CMU index, such as ``"run/jog, sudden stop"``.

    Returns
    -------
    str
        The class of the first rule that matches; ``"unknown"`` where the text says nothing about
        the motion, ``"other"`` where no rule matches.

    Examples
    --------
    >>> classify_description("walk on uneven terrain")
    'walk'
    >>> classify_description("JumpSmallForward")
    'jump'
    """
    words = normalise_description(text)
    for name, pattern in _compiled_rules():
        if pattern.search(words):
            return name
    return OTHER
