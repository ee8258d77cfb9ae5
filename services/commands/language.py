"""Verbs about understanding, without a running system."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from services.commands import exit_codes
from services.commands.output import print_json, say

if TYPE_CHECKING:
    from services.grounding.model import GroundingModel
    from services.grounding.rewriter import Rewrite
    from services.grounding.understanding import Understanding


def ground(
    text: Annotated[str, tyro.conf.Positional],
    robot: str = "husky",
    json: bool = False,
    plot: Path | None = None,
    rewriter: str | None = None,
    rewriter_model: str = "default",
) -> int:
    """Understand an instruction.

    Args:
        text: what is said, in English.
        robot: one of 'incognita robots'.
        json: one JSON document on stdout.
        plot: PNG, SVG or PDF file for a drawing of tree, factors and alternatives.
        rewriter: address of an OpenAI-compatible server, http://127.0.0.1:8080/v1, that is asked
            to say again in known words what the parser cannot complete; by default none is.
        rewriter_model: the model's name on that server.
    """
    from services.grounding.model import GroundingModel
    from services.grounding.report import describe, document

    model = GroundingModel.load(robot)
    started = time.perf_counter()
    understanding, rewrite = _understand(model, text, rewriter, rewriter_model)
    behaviors = model.behaviors(understanding)
    elapsed_ms = 1000 * (time.perf_counter() - started)
    if plot is not None:
        _draw(model, understanding, plot)
    if json:
        said = {"rewritten": rewrite.text, "rewriter": rewrite.reason or "taken"} if rewrite else {}
        print_json(document(robot, understanding, behaviors, elapsed_ms) | said)
    else:
        print(describe(understanding, behaviors))
    return exit_codes.DONE if understanding.understood else exit_codes.NOT_UNDERSTOOD


def _understand(
    model: "GroundingModel", text: str, address: str | None, name: str
) -> "tuple[Understanding, Rewrite | None]":
    if address is None:
        return model.understand(text), None
    from services.grounding.rewriter import Rewriter, understand_rewritten

    understanding, rewrite = understand_rewritten(model, Rewriter(address, name), text)
    if rewrite:
        say(f"rewriter: {rewrite.text or 'no sentence'}: {rewrite.reason or 'taken'}")
    return understanding, rewrite


def _draw(model: "GroundingModel", understanding: "Understanding", path: Path) -> None:
    from services.grounding.drawing import draw
    from services.grounding.explanation import read_phrases

    draw(understanding, read_phrases(model, understanding), path)
    say(f"wrote {path}")
