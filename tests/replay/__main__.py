"""`python -m tests.replay [check|bless|record] [CASE...]`."""

import argparse
import sys
from importlib import import_module

from sim import vulkan
from tests.replay.cases import CASES, Case
from tests.replay.comparing import differences
from tests.replay.running import replayed, store, stored


def check(case: Case) -> list[str]:
    """What the service says otherwise than before."""
    expected = stored(case)
    return differences(expected, replayed(case, [step.heard for step in expected]))


def bless(case: Case) -> None:
    """Make what the service says now the reference."""
    store(case, replayed(case, [step.heard for step in stored(case)]))


def record(case: Case) -> None:
    """Take the inputs from an episode of today."""
    vulkan.activate()
    # Imported now: sapien must find the driver that was activated above.
    inputs = import_module("tests.replay.inputs").recorded(case)
    case.path.unlink(missing_ok=True)
    store(case, replayed(case, inputs))


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.replay")
    parser.add_argument("action", choices=("check", "bless", "record"), nargs="?", default="check")
    parser.add_argument("names", nargs="*", metavar="CASE", help="by default all")
    given = parser.parse_args()
    known = {case.name: case for case in CASES}
    if unknown := [name for name in given.names if name not in known]:
        parser.error(f"no case {unknown[0]!r}; cases are: {', '.join(known)}")
    changed = False
    for case in [known[name] for name in given.names] or CASES:
        if given.action != "check":
            {"bless": bless, "record": record}[given.action](case)
        found = check(case)
        changed = changed or bool(found)
        print(f"{case.name}: {len(stored(case))} inputs, {case.path.stat().st_size / 1e3:.0f} kB")
        print("".join(f"  {line}\n" for line in found[:20]), end="")
    return int(changed)


if __name__ == "__main__":
    sys.exit(main())
