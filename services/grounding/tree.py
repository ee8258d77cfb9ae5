"""Phrase trees and their bracket notation, `(NP (DT the) (NN cone))`."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from services.grounding.errors import GroundingError

_BRACKET_TOKEN = re.compile(r"[()]|[^\s()]+")


@dataclass(frozen=True)
class Word:
    """A leaf: one lexicon entry, whose parts are joined by `_` where it spans several words."""

    tag: str
    """Penn-like part of speech."""
    text: str
    """Lower-case lexicon form, or the word as written where the lexicon does not have it."""

    def bracket(self) -> str:
        """Returns the leaf in bracket notation."""
        return f"({self.tag} {self.text})"

    @property
    def surface(self) -> str:
        """The words separated by blanks."""
        return self.text.replace("_", " ")


@dataclass(frozen=True)
class Phrase:
    """An inner node: the λ of the correspondence graph (paper, sec:nlu)."""

    label: str
    children: "tuple[Phrase | Word, ...]"

    @property
    def words(self) -> tuple[Word, ...]:
        """The words that belong to this phrase and to none of its child phrases."""
        return tuple(child for child in self.children if isinstance(child, Word))

    @property
    def phrases(self) -> "tuple[Phrase, ...]":
        """The child phrases, left to right."""
        return tuple(child for child in self.children if isinstance(child, Phrase))

    @property
    def surface(self) -> str:
        """All words below this node separated by blanks."""
        return " ".join(child.surface for child in self.children)

    def bracket(self) -> str:
        """Returns the tree in bracket notation."""
        return f"({self.label} {' '.join(child.bracket() for child in self.children)})"

    def preorder(self) -> "Iterator[Phrase]":
        """Yields this phrase and all phrases below it, parents first."""
        yield self
        for child in self.phrases:
            yield from child.preorder()

    def leaves(self) -> Iterator[Word]:
        """Yields all words below this node, left to right."""
        for child in self.children:
            if isinstance(child, Word):
                yield child
            else:
                yield from child.leaves()


def parse_bracket(text: str) -> Phrase:
    """Reads one tree in bracket notation.

    Raises:
        GroundingError: brackets do not match, a node is empty, or the root is a single word.
    """
    tokens = _BRACKET_TOKEN.findall(text)
    node, rest = _read_node(tokens, 0, text)
    if rest != len(tokens) or isinstance(node, Word):
        raise GroundingError(f"not one phrase tree: {text!r}; allowed: (LABEL child ...)")
    return node


def _read_node(tokens: list[str], at: int, text: str) -> tuple[Phrase | Word, int]:
    """Reads the node that opens at token `at`; returns it and the position after it."""
    if len(tokens) < at + 3 or tokens[at] != "(" or tokens[at + 1] in "()":
        raise GroundingError(f"expected '(LABEL ...' at item {at + 1} of the tree {text!r}")
    label, at = tokens[at + 1], at + 2
    if tokens[at] not in "()" and at + 1 < len(tokens) and tokens[at + 1] == ")":
        return Word(label, tokens[at]), at + 2
    children: list[Phrase | Word] = []
    while at < len(tokens) and tokens[at] != ")":
        child, at = _read_node(tokens, at, text)
        children.append(child)
    if at >= len(tokens) or not children:
        raise GroundingError(f"node {label} is empty or not closed in the tree {text!r}")
    return Phrase(label, tuple(children)), at + 1
