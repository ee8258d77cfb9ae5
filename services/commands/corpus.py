"""Corpora of the grounding: checking them, proposing new examples, how good what they teach is."""

import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from schemas.errors import UserError
from services.commands.output import print_json
from services.grounding.annotate import borrowed_model, check_corpus, propose
from services.grounding.corpus import CORPORA, read_held_out
from services.grounding.errors import GroundingError
from services.grounding.model import GroundingModel


def run(robot: str, check: Path | None, annotate: Path | None, like: str | None, json: bool) -> int:
    """Checks a corpus file or proposes annotations; see `training.train` for the arguments."""
    if (check is None) == (annotate is None) or (check is not None and like is not None):
        raise UserError("give --check FILE, or --annotate FILE with or without --like ROBOT")
    try:
        if check is not None:
            _check(check, robot, json)
        elif annotate is not None:
            model = borrowed_model(robot, like) if like else GroundingModel.load(robot)
            _annotate(annotate, model, json)
    except (GroundingError, FileNotFoundError, UnicodeDecodeError) as error:
        raise UserError(str(error)) from error
    return 0


def _check(path: Path, robot: str, json: bool) -> None:
    found = check_corpus(path, robot)
    if json:
        print_json({"file": str(path), **asdict(found)})
        return
    print(f"{path}: {found.examples} examples, {found.phrases} phrases, no error")
    for text in found.repeated:
        print(f"  stands there twice: {text}")
    for text in found.other_trees:
        print(f"  the parser's best tree is another one: {text}")
    for kind, names in found.unused.items():
        print(f"  {kind} without an example: {', '.join(names)}")


def _annotate(path: Path, model: GroundingModel, json: bool) -> None:
    text = sys.stdin.read() if str(path) == "-" else path.read_text(encoding="utf-8")
    proposals = [propose(model, line) for line in text.splitlines() if line.strip()]
    if json:
        print_json({"proposals": proposals})
    else:
        print("\n".join(proposals), end="")


def evaluation(robot: str) -> dict[str, Any]:
    """Reliability and confusion of a robot's weights on its held-out sentences, if it has any."""
    from services.grounding.training.evaluation import evaluate

    path = CORPORA / f"{robot}.heldout.txt"
    if not path.exists():
        return {}
    model = GroundingModel.load(robot)
    return evaluate(model, read_held_out(path, model.table))
