"""The space of annotation and behaviour symbols of one robot, as blocks of one index range.

Block by block (paper, Eqs. annotation-symbol-space and behavior-inference-space, in classes):

    class      Γ^{O_C}, Γ^L    E symbols            hydrant
    relation   Γ^S             S                    back()
    region     Γ^{R_S}         S x E                back(cone)
    fact       Γ^{R_C}         S x E x E            back(hydrant, cone)
    action     Γ^{A_O}         A x E                navigate(hydrant)
    mode       Γ^M             M                    mode(quickly)
    degree     "nearest"       D                    degree(comparative)

E joins object classes and locations, so that "the kitchen down the hallway" has its symbols too.
The action tuple of the paper is factored: its relation, reference and mode are the fact, region and
mode symbols that are true at the same phrase, which keeps the space linear in each of them.
"""

import re
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robots.symbols import SymbolSpace
from services.grounding.errors import GroundingError
from services.grounding.lexicon import constituents

KINDS = ("class", "relation", "region", "fact", "action", "mode", "degree")
ROBOT = "robot"
"""The class that stands for the robot itself, landmark of "the cone on the left"."""
UNKNOWN = "unknown"
"""The symbol of every kind for what the robot has no name for; mode or relation left open."""

_SYMBOL = re.compile(r"(?:(region|action):)?([\w ]+?)(?:\(([\w ]*)(?:, *([\w ]+))?\))?$")


@dataclass(frozen=True)
class Symbol:
    """One symbol in words."""

    kind: str
    head: str
    """Class, relation, action, mode or degree name."""
    arguments: tuple[str, ...] = ()
    """Classes: (landmark) of a region, (figure, landmark) of a fact, (object) of an action."""

    def __str__(self) -> str:
        if self.kind == "class":
            return self.head
        if self.kind in ("mode", "degree"):
            return f"{self.kind}({self.head})"
        return f"{self.head}({', '.join(self.arguments)})"


@dataclass(frozen=True)
class SymbolTable:
    """Bijection between symbols and indices, and the static attributes of every symbol."""

    space: SymbolSpace

    @cached_property
    def names(self) -> dict[str, tuple[str, ...]]:
        """Constituent names by kind: class, relation, action, mode, degree."""
        return constituents(self.space)

    @cached_property
    def symbols(self) -> tuple[Symbol, ...]:
        """All symbols in index order."""
        c, r = self.names["class"], self.names["relation"]
        return (
            *(Symbol("class", e) for e in c),
            *(Symbol("relation", s) for s in r),
            *(Symbol("region", s, (e,)) for s in r for e in c),
            *(Symbol("fact", s, (f, e)) for s in r for f in c for e in c),
            *(Symbol("action", a, (e,)) for a in self.names["action"] for e in c),
            *(Symbol("mode", m) for m in self.names["mode"]),
            *(Symbol("degree", d) for d in self.names["degree"]),
        )

    @cached_property
    def index(self) -> dict[Symbol, int]:
        """Index of every symbol."""
        return {symbol: number for number, symbol in enumerate(self.symbols)}

    @cached_property
    def kind_of(self) -> NDArray[np.int64]:
        """Index into `KINDS` of every symbol (N,)."""
        return np.array([KINDS.index(symbol.kind) for symbol in self.symbols])

    @cached_property
    def blocks(self) -> dict[str, NDArray[np.int64]]:
        """Symbol indices by kind, shaped by constituents: class (E,), fact (S, E, E), ..."""
        e, s = len(self.names["class"]), len(self.names["relation"])
        a = len(self.names["action"])
        shapes = {"region": (s, e), "fact": (s, e, e), "action": (a, e)}
        found = {kind: np.flatnonzero(self.kind_of == n) for n, kind in enumerate(KINDS)}
        return {kind: at.reshape(shapes.get(kind, at.shape)) for kind, at in found.items()}

    @cached_property
    def attributes(self) -> tuple[str, ...]:
        """Names of the static attributes; the last one is a pad that no weight refers to."""
        named = dict.fromkeys(name for symbol in self.symbols for name in _attributes(symbol))
        return (*named, "")

    @cached_property
    def attributes_of(self) -> NDArray[np.int64]:
        """Attribute indices of every symbol, padded with the last attribute (N, 4)."""
        number = {name: at for at, name in enumerate(self.attributes)}
        table = np.full((len(self.symbols), 4), len(number) - 1)
        for row, symbol in enumerate(self.symbols):
            found = [number[name] for name in _attributes(symbol)]
            table[row, : len(found)] = found
        return table

    def text(self, at: int) -> str:
        """A symbol in words, such that `parse` gives it back."""
        symbol = self.symbols[at]
        plain = str(symbol)
        return plain if self.parse(plain) == at else f"{symbol.kind}:{plain}"

    def parse(self, text: str) -> int:
        """Index of the symbol written as in the table above.

        Where relations and actions share a name, "left(cone)" is a region and "unknown(cone)" an
        action; "action:left(cone)" and "region:unknown(cone)" are the others.

        Raises:
            GroundingError: malformed text, or a name that the robot's symbol space lacks.
        """
        match = _SYMBOL.fullmatch(text.strip())
        if not match:
            raise GroundingError(f"symbol {text!r}; allowed: name, name(class), name(class, class)")
        kind, head, *arguments = match.groups()
        given = tuple(name for name in arguments if name)
        symbol = Symbol(kind, head, given) if kind else self._resolve(head, given, "(" in text)
        if symbol not in self.index:
            raise GroundingError(f"symbol {text!r}; allowed names: {self._allowed()}")
        return self.index[symbol]

    def _resolve(self, head: str, arguments: tuple[str, ...], bracketed: bool) -> Symbol:
        if not bracketed:
            return Symbol("class", head)
        if head in ("mode", "degree") and len(arguments) == 1:
            return Symbol(head, arguments[0])
        if head in self.names["action"] and head not in self.names["relation"]:
            return Symbol("action", head, arguments)
        kind = ("relation", "region", "fact")[len(arguments)]
        # "unknown" is a relation and an action; as an action it is the commoner annotation.
        if head == "unknown" and kind == "region":
            kind = "action"
        return Symbol(kind, head, arguments)

    def _allowed(self) -> str:
        return "; ".join(f"{kind}: {', '.join(names)}" for kind, names in self.names.items())


def _attributes(symbol: Symbol) -> tuple[str, ...]:
    slots = {"region": ("landmark",), "fact": ("figure", "landmark"), "action": ("object",)}
    arguments = zip(slots.get(symbol.kind, ()), symbol.arguments, strict=True)
    return (
        symbol.kind,
        f"{symbol.kind}={symbol.head}",
        *(f"{symbol.kind}.{slot}={name}" for slot, name in arguments),
    )
