"""Several things to do in one sentence: each is a clause of its own and is grounded by itself.

"go to the cone and then to the tree" is "go to the cone" and "go to the tree": what the clauses
share is distributed over them.  A reading of the sentence is one reading of each clause; "it"
stands for what the clauses before it are about.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from services.grounding.dcg import Distribution, combinations
from services.grounding.features import SymbolSet
from services.grounding.possession import head, spelled_out
from services.grounding.symbols import ROBOT, UNKNOWN, SymbolTable
from services.grounding.tree import Phrase, Word

CLAUSES = ("VP", "S")
GOALS = ("PP", "NP")
CONJUNCTION = "CC"
CORRECTION, NEGATION = "CORR", "NEG"
"""Of "no, not the cone, the hydrant" only the hydrant is meant; the rest is for the dialogue."""
PRONOUNS = (("PRP", "it"), ("PRP", "them"), ("NN", "one"), ("NN", "ones"))
ONE = Word("NN", "one")
MAX_STEPS = 8


def clauses(tree: Phrase) -> tuple[Phrase, ...]:
    """The clauses of a tree in order; the tree itself if it says one thing only."""
    if tree.label == CORRECTION:
        meant = [part for part in tree.phrases if part.label != NEGATION]
        return clauses(meant[-1]) if meant else (tree,)
    parts = [part for part in tree.phrases if part.label in CLAUSES]
    verbs = [word for word in tree.words if word.tag == "VB"]
    if len(parts) > 1 and not verbs and _is_list(tree, parts):
        return tuple(clause for part in parts for clause in clauses(part))[:MAX_STEPS]
    if verbs:
        return _distributed(tree)[:MAX_STEPS]
    return (tree,)


def _is_list(tree: Phrase, parts: Sequence[Phrase]) -> bool:
    """Whether all parts say or ask something by themselves, as "(S (NP) (VP is ..))" does not."""
    return all(part.label == "S" or _has(part, "VB") for part in parts)


def _has(tree: Phrase, tag: str) -> bool:
    return any(word.tag == tag for word in tree.leaves())


def _distributed(clause: Phrase) -> tuple[Phrase, ...]:
    """A clause once for each of the goals that it lists."""
    for at, child in enumerate(clause.children):
        if isinstance(child, Word) or child.label not in GOALS:
            continue
        goals = _goals(child)
        if len(goals) > 1:
            before, after = clause.children[:at], clause.children[at + 1 :]
            return tuple(Phrase(clause.label, (*before, goal, *after)) for goal in goals)
    return (clause,)


def _goals(phrase: Phrase) -> tuple[Phrase, ...]:
    """The members of a list of goals; the phrase itself if it is none."""
    parts = [part for part in phrase.phrases if part.label == phrase.label]
    if len(parts) > 1 and any(word.tag == CONJUNCTION for word in phrase.words):
        return tuple(goal for part in parts for goal in _goals(part))
    if phrase.label == "PP" and len(phrase.phrases) == 1 and phrase.words[:1]:
        # Only a goal: "near the cone and the tree" is one place with two landmarks.
        inner = _goals(phrase.phrases[0]) if phrase.words[0].tag == "TO" else ()
        if len(inner) > 1:
            return tuple(Phrase("PP", (*phrase.words, goal)) for goal in inner)
    return (phrase,)


@dataclass(frozen=True)
class SequenceReading:
    """What the clauses of one tree mean."""

    whole: Distribution
    """Over the symbols of all clauses together."""
    first: Distribution
    """The same without all clauses that ask for something but the first: what to do now."""
    steps: tuple[SymbolSet, ...]
    """The best reading of every clause that asks for something, in order."""


def read(
    tree: Phrase, infer: Callable[[Phrase], Distribution], table: SymbolTable
) -> SequenceReading:
    """Grounds every clause of a tree.

    Args:
        tree: of the sentence.
        infer: the distribution over the symbols of one clause.
        table: the symbols.
    """
    found: list[Distribution] = []
    about = UNKNOWN
    for clause in map(_with_nouns, clauses(spelled_out(tree))):
        symbols = infer(clause if about == UNKNOWN else _resolved(clause, about))
        about = _about(symbols, table, about)
        found.append(symbols)
    asks = [at for at, one in enumerate(found) if _asks(_best(one), table)]
    later = asks[1:]
    return SequenceReading(
        whole=_joined(found),
        first=_joined([one for at, one in enumerate(found) if at not in later]),
        steps=tuple(_best(found[at]) for at in asks),
    )


def _joined(clauses_: Sequence[Distribution]) -> Distribution:
    if len(clauses_) == 1:
        return clauses_[0]
    joined: Distribution = {}
    for probability, symbols in combinations(clauses_):
        joined[symbols] = joined.get(symbols, 0.0) + probability
    return joined


def _best(found: Distribution) -> SymbolSet:
    return max(found, key=lambda symbols: found[symbols], default=frozenset())


def _asks(symbols: SymbolSet, table: SymbolTable) -> bool:
    return any(table.symbols[at].kind == "action" for at in symbols)


def _about(found: Distribution, table: SymbolTable, before: str) -> str:
    """The class that a clause is about: what is to be done with it, or what is said of it."""
    symbols = [table.symbols[at] for at in sorted(_best(found))]
    named = {symbol.kind: symbol.arguments or (symbol.head,) for symbol in symbols[::-1]}
    for kind in ("action", "fact", "class"):
        name = named.get(kind, (UNKNOWN,))[0]
        if name not in (UNKNOWN, ROBOT):
            return name
    return before


def _with_nouns(phrase: Phrase) -> Phrase:
    """A phrase whose "one" is the noun beside it: "the cone, the one ...", "it is the one ..."."""
    children = [_with_nouns(c) if isinstance(c, Phrase) else c for c in phrase.children]
    if phrase.label in ("NP", "S") and isinstance(children[0], Phrase):
        noun = head(children[0])
        if noun and noun != ONE:
            children[1:] = [_renamed(child, noun) for child in children[1:]]
    return Phrase(phrase.label, tuple(children))


def _renamed(node: Phrase | Word, noun: Word) -> Phrase | Word:
    """The same with a noun for "one", but not within phrases about other things."""
    if isinstance(node, Word):
        return noun if node == ONE else node
    if node.label not in ("NP", "VP"):
        return node
    return Phrase(node.label, tuple(_renamed(child, noun) for child in node.children))


def _resolved(clause: Phrase, name: str) -> Phrase:
    """A clause with the noun that its pronouns stand for."""
    noun = Word("NN", name.replace(" ", "_"))
    return Phrase(
        clause.label,
        tuple(
            _resolved(child, name)
            if isinstance(child, Phrase)
            else noun
            if (child.tag, child.text) in PRONOUNS
            else child
            for child in clause.children
        ),
    )
