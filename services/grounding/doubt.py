"""When one reading alone is not good enough: unknown words, what is possible, what to say."""

import difflib

from services.grounding.lexicon import Lexicon, constituents, printed
from services.grounding.questions import either, with_article
from services.grounding.symbols import ROBOT
from services.grounding.tree import Phrase
from services.grounding.understanding import UNKNOWN, Annotation, Intent

MAX_NAMED = 8
"""Unknown words named in an answer."""
MAX_LETTERS = 24
MIN_SIMILARITY = 0.65
MIN_CONFIDENCE = 0.35
"""A best reading below this is as good as none."""

NOT_UNDERSTOOD = "What shall I do, and where?"

_KIND_TITLES = {"class": "object"}
_CONTENT = ("NN", "JJ", "VB")


def unknown_words(tree: Phrase, lexicon: Lexicon) -> tuple[str, ...]:
    """Content words of a tree that the lexicon lacks, in the order of the sentence."""
    words = (w for w in tree.leaves() if w.tag in _CONTENT and not lexicon.known(w.tag, w.text))
    return tuple(dict.fromkeys(_shortened(word.text) for word in words))[:MAX_NAMED]


def _shortened(word: str) -> str:
    return word if len(word) <= MAX_LETTERS else word[: MAX_LETTERS - 1] + "…"


def suggestions(words: tuple[str, ...], lexicon: Lexicon) -> dict[str, tuple[str, ...]]:
    """Known words that look like each unknown one; words that resemble none are left out."""
    entries = (e for e in lexicon.content_words() if printed(e.tag) in _CONTENT)
    known = sorted({" ".join(entry.words) for entry in entries})
    near = {w: difflib.get_close_matches(w, known, 3, MIN_SIMILARITY) for w in words}
    return {word: _singular(found) for word, found in near.items() if found}


def _singular(words: list[str]) -> tuple[str, ...]:
    """Words without the plurals of others among them."""
    return tuple(word for word in words if not (word.endswith("s") and word[:-1] in words))


def possible(lexicon: Lexicon) -> tuple[str, ...]:
    """One line for every kind of symbol: its names with some of the words for them."""
    lines: list[str] = []
    for kind, names in constituents(lexicon.symbols).items():
        known = [_with_words(kind, name, lexicon) for name in names if name != UNKNOWN]
        lines.append(f"{_KIND_TITLES.get(kind, kind)}: {', '.join(known)}")
    return tuple(lines)


def _with_words(kind: str, name: str, lexicon: Lexicon) -> str:
    entries = (e for e in lexicon.content_words() if (kind, name) in e.meanings)
    words = dict.fromkeys(" ".join(e.words) for e in entries if printed(e.tag) != "NN")
    others = [word for word in words if word != name][:3]
    return f"{name} ({', '.join(others)})" if others else name


def is_understood(
    annotations: tuple[Annotation, ...],
    intents: tuple[Intent, ...],
    statement_mass: float,
    partial: bool,
    words: tuple[str, ...],
) -> bool:
    """Whether the best reading can be acted on, or noted down if it is a statement.

    Args:
        annotations: readings as a statement, best first.
        intents: readings as something to do, best first.
        statement_mass: probability that nothing is to be done.
        partial: whether the grammar covers only parts of the text.
        words: unknown words of the text.
    """
    if not annotations or (partial and words):
        return False
    if not intents or intents[0].probability < statement_mass:
        return _is_noteworthy(annotations[0], partial)
    best = intents[0]
    # The robot itself is no goal unless a landmark says where it is to stand.
    placed = best.landmark != UNKNOWN or (best.relation == UNKNOWN and best.object != ROBOT)
    known = UNKNOWN not in (best.action, best.object)
    return known and placed and best.probability >= MIN_CONFIDENCE


def _is_noteworthy(statement: Annotation, partial: bool) -> bool:
    """Loose nouns between fragments say nothing; a relation between them does."""
    said = statement.relations if partial else statement.objects
    return bool(said) and statement.probability >= MIN_CONFIDENCE


def question(
    understood: bool,
    words: tuple[str, ...],
    near: dict[str, tuple[str, ...]],
    intents: tuple[Intent, ...],
) -> str | None:
    """What to ask about one sentence alone, or None if the best reading is clear."""
    if not understood and near:
        word, known = next(iter(near.items()))
        return f'By "{word}" do you mean {either(tuple(map(with_article, known)))}?'
    if not understood and words:
        quoted = tuple(f'"{word}"' for word in words)
        return f"I do not know {either(quoted)}. What shall I do?"
    if not understood:
        return NOT_UNDERSTOOD
    return None
