"""Decisions as rows of a table."""

import csv
from pathlib import Path
from typing import TextIO

import numpy as np

from schemas import topics
from schemas.belief import MapBelief
from schemas.task import Decision
from services.runtime.log_file import read_messages

HEAD = (
    "time_s",
    "instruction",
    "kind",
    "x_m",
    "y_m",
    "cost",
    "next_best_cost",
    "candidates",
    "confirmed",
    "effective_particles",
    "objects_seen",
    "reason",
)


def write_decisions(log: Path, out: TextIO) -> int:
    """Write one row for each decision, as comma-separated values; times since the first message.

    Returns:
        Number of decisions.

    Raises:
        LogError: not a readable log.
    """
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(HEAD)
    count, first_ns = 0, None
    texts: dict[str, str] = {}
    belief: MapBelief | None = None
    watched = (topics.ODOMETRY, topics.BELIEF, topics.INSTRUCTION, topics.DECISION)
    for log_ns, topic, message in read_messages(log, watched):
        first_ns = log_ns if first_ns is None else first_ns
        if topic is topics.BELIEF:
            belief = message
        elif topic is topics.INSTRUCTION:
            texts[message.id] = message.text
        elif topic is topics.DECISION:
            count += 1
            said = texts.get(message.instruction_id, message.instruction_id)
            rows.writerow(((log_ns - first_ns) / 1e9, said, *_row(message, belief)))
    return count


def _row(decision: Decision, belief: MapBelief | None) -> tuple[object, ...]:
    chosen = decision.chosen
    x, y = decision.positions[chosen].round(3).tolist()
    others = np.delete(decision.costs, chosen)
    return (
        decision.kinds[chosen],
        x,
        y,
        round(float(decision.costs[chosen]), 4),
        round(float(others.min()), 4) if len(others) else "",
        len(decision.kinds),
        round(decision.confirmed, 4),
        round(belief.effective_particles, 2) if belief else "",
        int(belief.seen.sum()) if belief else "",
        decision.reason,
    )
