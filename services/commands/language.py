"""Verbs about understanding, without a running system."""

import time
from typing import Annotated

import tyro

from services.commands import exit_codes
from services.commands.output import print_json


def ground(
    text: Annotated[str, tyro.conf.Positional], robot: str = "husky", json: bool = False
) -> int:
    """Understand an instruction.

    Args:
        text: what is said, in English.
        robot: one of 'incognita robots'.
        json: one JSON document on stdout.
    """
    from services.grounding.model import GroundingModel
    from services.grounding.report import describe, document

    model = GroundingModel.load(robot)
    started = time.perf_counter()
    understanding = model.understand(text)
    behaviors = model.behaviors(understanding)
    elapsed_ms = 1000 * (time.perf_counter() - started)
    if json:
        print_json(document(robot, understanding, behaviors, elapsed_ms))
    else:
        print(describe(understanding, behaviors))
    return exit_codes.DONE if understanding.understood else exit_codes.NOT_UNDERSTOOD
