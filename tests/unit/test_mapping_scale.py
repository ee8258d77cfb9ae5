"""A large world: 200 things seen from 500 pose nodes."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from sim.experiments.bench_mapping import draw, sizes_of
from sim.experiments.report import Report, Row
from tests.benchmarks.ring import Ring
from tests.unit.test_mapping_faults import assert_sound

OBJECTS, NODES = 200, 500
SIZES = ((100, 200, 20), (10, 200, 20), (100, 50, 20), (100, 200, 5), (100, 500, 200))


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_200_objects_and_500_pose_nodes_fit() -> None:
    ring = Ring(particles=50, objects=OBJECTS)
    # The ring asserts at every step that nothing was reported.
    ring.drive_until(NODES // 2)
    tracemalloc.start()
    ring.drive_until(NODES - 5)
    ring.hear()
    ring.drive_until(NODES)
    grown, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    belief = ring.belief
    assert belief is not None
    assert_sound(belief)
    assert belief.seen.sum() == OBJECTS
    assert len(belief.trajectory) == NODES
    error = belief.map_from_base.inverse() @ ring.base
    assert np.hypot(error.x, error.y) < 0.1
    # What Python holds for 250 more nodes: their poses, a grid that grew, and no history besides.
    assert grown < 30e6


def test_growth_is_drawn(tmp_path: Path) -> None:
    def row(name: str, ours: float) -> Row:
        return Row(
            row=name,
            metric="filter step, mean",
            unit="ms",
            better="lower",
            ours=ours,
            interval=(ours - 1, ours + 1),
        )

    names = [f"{p} particles, {n} pose nodes, {k} objects" for p, n, k in SIZES]
    rows = tuple(row(name, 10.0 + number) for number, name in enumerate(names))
    assert [sizes_of(one) for one in rows] == list(SIZES)
    report = Report(
        bench="mapping", seed=0, runs=1, git="", machine="", elapsed_s=0.0, rows=rows, failures={}
    )
    draw(report, tmp_path / "mapping.png")
    assert (tmp_path / "mapping.png").stat().st_size > 1000
