"""What a thing has: "the tree with a cone behind it", "the box that contains the ball".

Factors join a place with the head noun beside it. Here the head noun is within the place, as "it",
or it is not said at all; put there, "a cone behind the tree" is a place like all others.
"""

from services.grounding.tree import Phrase, Word

IT = (Word("PRP", "it"), Word("PRP", "them"), Word("PRP", "itself"))
PREPOSITION = Word("IN", "with")
CONTAINING = frozenset(
    {"contains", "contain", "containing", "holds", "hold", "holding", "houses", "housing"}
    | {"hosts", "includes", "stores", "storing", "encloses", "enclosing"}
)
"""Verbs of which the object is inside the subject."""
HAVING = frozenset({"has", "have", "had", "got", "having"})
HAS = Word("VBZ", "has")
"""What all of these verbs become."""
VERBS = ("VBZ", "VBG", "VBD")
CLAUSES = ("PP", "SBAR", "VP")


def spelled_out(tree: Phrase) -> Phrase:
    """A tree in which what a thing has is said to be at that thing.

    "contains the ball" becomes "has the ball in it", and the "it" of what a thing has becomes the
    noun of that thing. Only the former adds phrases to the tree.
    """
    return _owned(_contained(tree))


def head(phrase: Phrase) -> Word | None:
    """The noun of a noun phrase."""
    if phrase.label != "NP":
        return None
    nouns = [word for word in phrase.words if word.tag == "NN"]
    return nouns[-1] if nouns else next((head(part) for part in phrase.phrases[:1]), None)


def _contained(phrase: Phrase) -> Phrase:
    """A phrase in which what is contained is what one has "in it"."""
    contains = any(_is_verb(word, CONTAINING) for word in phrase.words)
    children: list[Phrase | Word] = []
    for child in phrase.children:
        if isinstance(child, Word):
            children.append(HAS if _is_verb(child, CONTAINING) else child)
        else:
            inner = _contained(child)
            children.append(_in_it(inner) if contains and child.label == "NP" else inner)
    return Phrase(phrase.label, tuple(children))


def _is_verb(word: Word, verbs: frozenset[str]) -> bool:
    return word.tag in VERBS and word.text in verbs


def _in_it(thing: Phrase) -> Phrase:
    place = Phrase("PP", (Word("IN", "in"), Phrase("NP", (IT[0],))))
    return Phrase("NP", (thing, place))


def _owned(phrase: Phrase) -> Phrase:
    """A phrase with the head noun for the "it" of what the head has, innermost first."""
    children = [_owned(child) if isinstance(child, Phrase) else child for child in phrase.children]
    if phrase.label in ("NP", "S") and isinstance(children[0], Phrase):
        noun = head(children[0])
        if noun:
            children[1:] = [_of(child, noun) for child in children[1:]]
    return Phrase(phrase.label, tuple(children))


def _of(clause: Phrase | Word, noun: Word) -> Phrase | Word:
    """A clause about a noun, with the noun for "it" where the clause says what it has."""
    if isinstance(clause, Word) or clause.label not in CLAUSES:
        return clause
    if any(word == PREPOSITION or _is_verb(word, HAVING) for word in clause.words):
        return _owned_by(clause, noun)
    if clause.label != "SBAR":
        return clause
    return Phrase(clause.label, tuple(_of(child, noun) for child in clause.children))


def _owned_by(phrase: Phrase, noun: Word) -> Phrase:
    children: list[Phrase | Word] = []
    for child in phrase.children:
        if isinstance(child, Phrase):
            children.append(_owned_by(child, noun))
        else:
            children.append(noun if child in IT else HAS if _is_verb(child, HAVING) else child)
    return Phrase(phrase.label, tuple(children))
