"""How a step of the filter grows with particles, pose nodes and objects.

There is no peer, hence nothing that a baseline could hold it to; `bench mapping --plot` draws it.
"""

from tests.benchmarks.mapping import ASKED, name_of, settled, timed_steps
from tests.benchmarks.rows import Row, Samples

SIZES = (
    ASKED,
    *((count, 200, 20) for count in (10, 50, 200, 500)),
    *((100, count, 20) for count in (50, 100, 350, 500)),
    *((100, 200, count) for count in (5, 50, 100, 200)),
    (100, 500, 200),
)
"""Growth with each of the three, and with all."""


def measure(rounds: int) -> list[Row]:
    """The mean step at every size."""
    return [_growth(*sizes, rounds) for sizes in SIZES]


def _growth(particles: int, nodes: int, objects: int, rounds: int) -> Row:
    steps, _ = timed_steps(settled(particles, nodes, objects), rounds)
    return Row(
        row=name_of(particles, nodes, objects),
        metric="filter step, mean",
        unit="ms",
        better="lower",
        ours=float(steps.mean()),
        interval=_mean_interval(steps),
    )


def _mean_interval(samples: Samples) -> tuple[float, float]:
    half = 1.96 * float(samples.std()) / len(samples) ** 0.5
    return float(samples.mean()) - half, float(samples.mean()) + half
