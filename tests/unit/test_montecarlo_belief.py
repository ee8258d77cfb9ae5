"""A log tells how the belief grew."""

from pathlib import Path

import numpy as np

from schemas import topics
from schemas.codec import encode
from schemas.task import Decision
from schemas.topics import Output
from services.runtime.mailbox import Sample
from services.runtime.record import LogWriter
from sim.experiments.bench_belief import draw_snapshots, snapshots_of
from tests.unit.test_montecarlo_arms import true_map


def decision(stamp_ns: int) -> Decision:
    return Decision(
        stamp_ns=stamp_ns, instruction_id="a", kinds=("stop", "frontier"),
        positions=np.array([[0.0, 0.0], [3.0, 1.0]]), costs=np.array([9.0, 2.0]), chosen=1,
        confirmed=0.0, reason="",
    )  # fmt: skip


def logged(path: Path, *outputs: Output) -> Path:
    writer = LogWriter(path, {})
    for number, output in enumerate(outputs):
        stamp_ns = 1000 + number
        sample = Sample(output.topic, encode(output.message), 1, number, stamp_ns)
        writer.write(sample, stamp_ns)
    writer.close()
    return path


def test_a_decision_stands_with_the_belief_it_was_taken_on(tmp_path: Path) -> None:
    (grid, early), (_, late) = true_map(5), true_map(9)
    log = logged(
        tmp_path / "a.mcap",
        topics.GRID.of(grid),
        topics.BELIEF.of(early),
        topics.BELIEF.of(late),
        topics.DECISION.of(decision(5)),
        topics.DECISION.of(decision(7)),
    )
    (found,) = snapshots_of(log)
    assert found.belief.stamp_ns == found.decision.stamp_ns == 5
    assert (found.chosen, found.confirmed) == ("frontier", 1.0)


def test_a_run_with_fewer_decisions_than_panels_is_drawn(tmp_path: Path) -> None:
    grid, belief = true_map(5)
    outputs = (topics.GRID.of(grid), topics.BELIEF.of(belief), topics.DECISION.of(decision(5)))
    draw_snapshots(snapshots_of(logged(tmp_path / "a.mcap", *outputs)), tmp_path / "a.png", "a")
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
