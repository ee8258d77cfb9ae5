"""K-best inference over independent factors is exact; symbols have a bijection to text."""

import itertools
import math

import numpy as np
import pytest

from robots.catalogue import get_robot
from robots.symbols import SymbolSpace, get_symbols
from services.grounding.dcg import best_sets
from services.grounding.errors import GroundingError
from services.grounding.symbols import SymbolTable

TABLE = SymbolTable(get_robot("husky").symbols)


def test_best_sets_are_those_of_an_exhaustive_search() -> None:
    logits = np.random.default_rng(3).normal(size=9)
    log_odds = [
        (-float(np.logaddexp(0.0, np.where(chosen, -logits, logits)).sum()), chosen)
        for chosen in itertools.product([False, True], repeat=len(logits))
    ]
    wanted = sorted(log_odds, reverse=True)[:7]
    found = best_sets(logits, 7)
    assert [p for p, _ in found] == pytest.approx([p for p, _ in wanted])
    assert [set(s) for _, s in found] == [set(np.flatnonzero(c).tolist()) for _, c in wanted]


def test_all_sets_of_few_symbols_sum_to_one() -> None:
    found = best_sets(np.array([0.3, -1.0, 2.0]), 8)
    assert len({symbols for _, symbols in found}) == 8
    assert math.fsum(math.exp(p) for p, _ in found) == pytest.approx(1.0)


def test_symbol_count_is_the_papers() -> None:
    space = TABLE.space
    e, s = len(space.object_classes + space.locations), len(space.relations)
    kinds = len(space.actions) * e + len(space.modes) + 1
    assert len(TABLE.symbols) == e + s + s * e + s * e * e + kinds


@pytest.mark.parametrize("robot", ["husky", "wheelchair", "husky_ur5"])
def test_every_symbol_reads_back_as_itself(robot: str) -> None:
    table = SymbolTable(get_symbols(robot))
    assert [table.parse(table.text(at)) for at in range(len(table.symbols))] == list(
        range(len(table.symbols))
    )


def test_blocks_agree_with_symbols() -> None:
    e = TABLE.names["class"]
    at = TABLE.blocks["fact"][
        TABLE.names["relation"].index("back"), e.index("cone"), e.index("car")
    ]
    assert str(TABLE.symbols[at]) == "back(cone, car)"


def test_another_robot_is_only_other_data() -> None:
    space = SymbolSpace(("ball", "box"), ("lab",), ("inside",), ("pick",), ("unknown",))
    table = SymbolTable(space)
    assert str(table.symbols[table.parse("inside(ball, lab)")]) == "inside(ball, lab)"


@pytest.mark.parametrize("text", ["fence", "back(cone, fence)", "back(cone", "over(cone)", ""])
def test_unknown_symbols_name_what_is_allowed(text: str) -> None:
    with pytest.raises(GroundingError, match="allowed"):
        TABLE.parse(text)
