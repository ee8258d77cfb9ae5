"""Helps to write corpora: proposes the annotation of new sentences and checks corpus files.

A proposal is the parser's tree with the model's own symbols at every phrase, in the format that
`corpus` reads. What the model is not sure of stands above it in comments, for a person to correct.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from robots.symbols import get_symbols
from services.grounding.corpus import Example, read_corpus
from services.grounding.explanation import PhraseReading, read_phrases
from services.grounding.features import SymbolFeatures
from services.grounding.grammar import Grammar
from services.grounding.lexicon import Lexicon
from services.grounding.model import GroundingModel
from services.grounding.parser import parse
from services.grounding.symbols import UNKNOWN, SymbolTable
from services.grounding.text import tokenize
from services.grounding.understanding import Understanding

SURE = (0.1, 0.9)
"""A symbol whose probability lies between is worth a look."""


def borrowed_model(robot: str, lender: str) -> GroundingModel:
    """A model for a robot that has symbols but no weights yet, from those of another robot.

    What is learned of names that both have, and of how symbols follow from those of the child
    phrases, holds for the other robot too; of its own names nothing is known but their words.

    Raises:
        UnknownLanguageError: one of the robots has no symbols.
        GroundingError: the lender has no weights.
    """
    lent = GroundingModel.load(lender)
    lexicon = Lexicon.load(get_symbols(robot))
    names = SymbolFeatures(SymbolTable(lexicon.symbols), lexicon).attributes
    column = {name: at for at, name in enumerate(lent.features.attributes)}
    factors = lent.weights.factors
    static = np.zeros((len(factors.static), len(names)))
    shared = [at for at, name in enumerate(names) if name in column]
    static[:, shared] = factors.static[:, [column[names[at]] for at in shared]]
    own = replace(lent.weights, factors=replace(factors, static=static), rules=None)
    return GroundingModel(lexicon, own)


def propose(model: GroundingModel, text: str) -> str:
    """One example in corpus format, with comments on what to look at.

    Text without words, or with far too many, gives a comment alone.
    """
    sentence = " ".join(text.split()).lstrip("# ")
    found = model.understand(sentence)
    readings = read_phrases(model, found)
    if not readings:
        return f"# nothing to annotate in {sentence[:80]!r}\n"
    remarks = [f"# {remark}" for remark in _remarks(found, readings)]
    phrases = [
        f"    {one.phrase.label} {one.phrase.surface}: {', '.join(one.best)}".rstrip()
        for one in readings
    ]
    return "\n".join([*remarks, sentence, f"    {found.parse}", *phrases]) + "\n"


def _remarks(found: Understanding, readings: Iterable[PhraseReading]) -> list[str]:
    remarks: list[str] = []
    if found.partial:
        remarks.append("the grammar covers only parts of this sentence: correct the tree")
    if found.unknown_words:
        remarks.append(f"words without a meaning yet: {', '.join(found.unknown_words)}")
    for one in readings:
        unsure = [f"{name} {p:.2f}" for name, p in one.symbols if SURE[0] < p < SURE[1]]
        if unsure:
            remarks.append(
                f"{one.phrase.label} {one.phrase.surface}: unsure of {', '.join(unsure)}"
            )
    return remarks


@dataclass(frozen=True)
class CorpusCheck:
    """What there is to know of a corpus without an error."""

    examples: int
    phrases: int
    repeated: tuple[str, ...]
    """Sentences that stand in it more than once."""
    other_trees: tuple[str, ...]
    """Sentences that the parser reads in another way: what is learned there is never used."""
    unused: dict[str, tuple[str, ...]]
    """Names of the robot's symbol space, by kind, that no symbol of the corpus has."""


def check_corpus(path: Path, robot: str) -> CorpusCheck:
    """Reads a corpus and looks for what would teach little or the wrong thing.

    Raises:
        UnknownLanguageError: the robot has no symbols.
        GroundingError: file, line, what is wrong and what is allowed.
    """
    lexicon, grammar = Lexicon.load(get_symbols(robot)), Grammar.load()
    table = SymbolTable(lexicon.symbols)
    examples = read_corpus(path, table)
    texts = Counter(example.text for example in examples)
    return CorpusCheck(
        examples=len(examples),
        phrases=sum(len(example.symbols) for example in examples),
        repeated=tuple(text for text, count in texts.items() if count > 1),
        other_trees=tuple(e.text for e in examples if not _is_best_tree(e, lexicon, grammar)),
        unused=_unused(examples, table),
    )


def _is_best_tree(example: Example, lexicon: Lexicon, grammar: Grammar) -> bool:
    parses = parse(lexicon.strip_fillers(tokenize(example.text)), lexicon, grammar)
    return bool(parses) and parses[0].tree == example.tree


def _unused(examples: Iterable[Example], table: SymbolTable) -> dict[str, tuple[str, ...]]:
    true = {table.symbols[at] for one in examples for symbols in one.symbols for at in symbols}
    # Which kind a name is of follows from the kinds of symbols that may bear it.
    named = {"class": {name for symbol in true for name in symbol.arguments}}
    for symbol in true:
        kind = "relation" if symbol.kind in ("region", "fact") else symbol.kind
        named.setdefault(kind, set()).add(symbol.head)
    left = {
        kind: tuple(name for name in names if name not in named.get(kind, ()) and name != UNKNOWN)
        for kind, names in table.names.items()
    }
    return {kind: names for kind, names in left.items() if names}
