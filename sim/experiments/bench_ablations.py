"""What each part of our method is worth: the rows with a relation, one part taken out at a time."""

import numpy as np

from sim.experiments.arms import ABLATIONS, trained
from sim.experiments.comparison import DISTANCE, EFFICIENCY, SUCCESS, compared
from sim.experiments.montecarlo import failures_of, jobs_of, progress_lines, run_jobs
from sim.experiments.perception_model import PerceptionSettings
from sim.experiments.report import Outcome, Settings
from sim.experiments.table1 import NULL, ROWS, rows_of, settings_of

TABLE_ROWS = tuple(row for row in ROWS if row.scenario.text != NULL)


def measure(settings: Settings) -> Outcome:
    """Every arm in a third of the worlds that are asked for, in ten at least."""
    perception = PerceptionSettings()
    count = max(10, settings.runs // 3)
    ablated = trained(ABLATIONS, "husky")
    runs = dict.fromkeys(("ours", *ablated), count)
    jobs = [j for row in TABLE_ROWS for j in jobs_of(row.scenario, runs, settings.seed, perception)]
    results = run_jobs(jobs, settings, progress_lines(settings.progress))
    rng = np.random.default_rng(settings.seed)
    metrics = (SUCCESS, EFFICIENCY, DISTANCE)
    return Outcome(
        rows=tuple(made for row in TABLE_ROWS for made in rows_of(row, results, rng)),
        failures=failures_of(results),
        comparisons=tuple(
            made
            for row in TABLE_ROWS
            for made in compared(row.scenario.name, results, ablated, metrics, rng)
        ),
        settings=(
            *settings_of(runs, perception),
            *(f"{arm} was left out: no weights" for arm in ABLATIONS if arm not in ablated),
        ),
    )
