"""Ordinary instructions are covered by the grammar, and quickly."""

import time
from itertools import groupby
from pathlib import Path
from statistics import median

import pytest

from robots.symbols import get_symbols
from services.grounding.grammar import Grammar
from services.grounding.lexicon import Lexicon
from services.grounding.parser import Parse, parse
from services.grounding.text import tokenize

SENTENCES = Path(__file__).parents[1] / "data" / "parser_sentences.txt"
MIN_SENTENCES = 150
MIN_COMPLETE = 0.98
MAX_MEDIAN_S = 0.01
"""Ten times what it takes on an idle core: tests share theirs."""


def sentences() -> list[tuple[str, list[str]]]:
    """(robot, its sentences) by the headings of the file."""
    lines = [line.strip() for line in SENTENCES.read_text(encoding="utf-8").splitlines()]
    heading = ""
    pairs: list[tuple[str, str]] = []
    for line in filter(None, lines):
        if line.startswith("#"):
            heading = line.lstrip("# ")
        else:
            pairs.append((heading, line))
    return [(robot, [text for _, text in group]) for robot, group in groupby(pairs, lambda p: p[0])]


def parses(text: str, lexicon: Lexicon) -> tuple[Parse, ...]:
    return parse(lexicon.strip_fillers(tokenize(text)), lexicon, Grammar.load())


@pytest.mark.parametrize(("robot", "texts"), sentences(), ids=lambda value: str(value)[:10])
def test_ordinary_instructions_parse_completely(robot: str, texts: list[str]) -> None:
    lexicon = Lexicon.load(get_symbols(robot))
    partial = [text for text in texts if parses(text, lexicon)[0].partial]
    assert len(partial) <= (1.0 - MIN_COMPLETE) * len(texts), partial


def test_there_are_enough_sentences_to_tell() -> None:
    assert sum(len(texts) for _, texts in sentences()) >= MIN_SENTENCES


def test_parsing_is_quick() -> None:
    robot, texts = sentences()[0]
    lexicon = Lexicon.load(get_symbols(robot))
    seconds: list[float] = []
    for text in texts[:60]:
        started = time.perf_counter()
        parses(text, lexicon)
        seconds.append(time.perf_counter() - started)
    assert median(seconds) < MAX_MEDIAN_S
