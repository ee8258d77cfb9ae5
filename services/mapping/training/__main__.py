"""Writes the weights anew: `python -m services.mapping.training`. Takes seconds.

The same code gives the same files. After a change of the code run it twice: the densities in
`priors.json` are fitted to posteriors that use the other weights as they are on disk.
"""

from pathlib import Path

import msgspec

from services.mapping.training.prior_training import WORLDS, train_priors
from services.mapping.training.relation_training import SCENES, SEED, train_relations

WEIGHTS = Path(__file__).parent.parent / "weights"


def write(name: str, weights: msgspec.Struct) -> None:
    """Weights as a file that people can read."""
    text = msgspec.json.format(msgspec.json.encode(weights), indent=2)
    (WEIGHTS / name).write_bytes(text + b"\n")


if __name__ == "__main__":
    write("relations.json", train_relations(SCENES, SEED, print))
    write("priors.json", train_priors(WORLDS, print))
