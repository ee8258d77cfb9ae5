"""Speed and quality beside named peers that are measured in the same run.

`python -m tests.benchmarks` prints the table; with `--bless` it becomes the committed baseline.
Ratios between us and a peer are compared with it, never absolute times: those depend on the
machine and on what else runs there.
"""
