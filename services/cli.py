"""The command line: one table of verbs. Nothing heavy is imported before a verb is chosen."""

import contextlib
import functools
import io
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module

from schemas.errors import InternalFaultError, MissingComponentError, UserError

USAGE = 2
EXIT_CODES: dict[type[BaseException], int] = {
    UserError: USAGE,
    MissingComponentError: 5,
    InternalFaultError: 1,
    KeyboardInterrupt: 1,
}
"""Errors that end a verb with one line instead of a traceback."""


@dataclass(frozen=True)
class Verb:
    """One verb: where its function is, and what it does in one line."""

    function: str
    """`module:function` below `services.commands`; typed arguments become its options."""
    summary: str
    example: str


VERBS: dict[str, Verb] = {
    "up": Verb("system:up", "start the robot, all services, the page and the recorder", "up"),
    "demo": Verb("system:demo", "start with a prepared world and instruction", "demo hydrant"),
    "service": Verb("fleet:service", "run one service in the foreground", "service mapping"),
    "hub": Verb(
        "fleet:hub", "what several machines connect to", "hub --tls certs/hub --role robot"
    ),
    "certs": Verb(
        "fleet:certs",
        "certificates for several machines",
        "certs make certs --host robot.local 10.0.0.1",
    ),
    "say": Verb("talk:say", "send an instruction to a running system", 'say "go to the cone"'),
    "answer": Verb("talk:answer", "answer the question that is open", 'answer "a cone"'),
    "cancel": Verb("talk:cancel", "drop the instruction", "cancel"),
    "stop": Verb("talk:stop", "latched stop of all motion", "stop"),
    "resume": Verb("talk:resume", "release the stop", "resume"),
    "status": Verb("look:status", "health of every service", "status --json"),
    "topics": Verb("look:topics", "the table of topics", "topics"),
    "graph": Verb("look:graph", "the processes and what flows between them, as Mermaid", "graph"),
    "watch": Verb("look:watch", "print messages of a running system", "watch decision -n 3"),
    "ground": Verb(
        "language:ground",
        "understand an instruction without a running system",
        'ground "go to the hydrant behind the cone" --robot husky',
    ),
    "episode": Verb(
        "experiments:episode",
        "one episode in lockstep, as fast as it computes",
        'episode --world hydrant --say "go to the hydrant behind the cone" --json',
    ),
    "look": Verb(
        "pictures:look", "what is seen in pictures of a camera or from files", "look --camera 0"
    ),
    "bench": Verb("bench:bench", "run an experiment beside the paper's", "bench grounding"),
    "train": Verb("training:train", "train from our own data", "train grounding"),
    "record": Verb("logs:record", "record a running system", "record --out run.mcap"),
    "replay": Verb("logs:replay", "play a log back", "replay runs/RUN.mcap --to web"),
    "log": Verb("logs:log", "inspect, check, mend or export a log", "log info runs/RUN.mcap"),
    "robots": Verb("look:robots", "the robots there are", "robots"),
    "worlds": Verb("look:worlds", "the worlds there are", "worlds"),
    "doctor": Verb("machine:doctor", "what this machine has and lacks", "doctor --fix"),
    "test": Verb("machine:test", "run every check and test", "test -k grounding"),
}

RAW = {"test"}
"""Verbs that take their arguments as they are."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb; returns the exit code of the contract."""
    given = list(sys.argv[1:] if arguments is None else arguments)
    if not given or given[0] in ("-h", "--help"):
        print(overview())
        return 0
    try:
        return run_verb(given[0], given[1:])
    except BrokenPipeError:
        # The reader has seen enough; the interpreter must not complain when it flushes stdout.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except tuple(EXIT_CODES) as error:
        print(f"incognita: {error or 'interrupted'}", file=sys.stderr)
        return next(code for kind, code in EXIT_CODES.items() if isinstance(error, kind))


def run_verb(name: str, arguments: list[str]) -> int:
    """Import a verb's function, read its arguments by its signature, call it."""
    if name not in VERBS:
        raise UserError(f"unknown verb {name!r}; verbs are: {', '.join(VERBS)}")
    verb = VERBS[name]
    module, function = verb.function.split(":")
    call = getattr(import_module(f"services.commands.{module}"), function)
    if name in RAW:
        return call(arguments)
    import tyro

    complaint = io.StringIO()
    try:
        with contextlib.redirect_stderr(complaint):
            read = tyro.cli(
                functools.wraps(call)(functools.partial(functools.partial, call)),
                prog=f"incognita {name}",
                args=arguments,
                config=(tyro.conf.FlagCreatePairsOff, tyro.conf.OmitArgPrefixes),
                description=f"{verb.summary.capitalize()}.\n\nExample: incognita {verb.example}",
            )
    except SystemExit as ended:
        if ended.code != USAGE:
            raise
        raise UserError(f"{_plain(complaint.getvalue())} (see 'incognita {name} --help')") from None
    return read()


def _plain(box: str) -> str:
    """A framed complaint as one line."""
    lines = [text for line in box.splitlines() if (text := line.strip("╭╮╰╯│─ "))]
    said = [line for line in lines if not line.startswith("For full helptext")]
    return ": ".join(said)[:300] or "wrong arguments"


def overview() -> str:
    """What `incognita --help` prints."""
    lines = [
        "usage: incognita VERB [ARGUMENTS]",
        "",
        "A robot runtime that follows instructions in places it has never seen.",
        "",
        *(f"  {name:<10}{verb.summary}" for name, verb in VERBS.items()),
        "",
        "'incognita VERB --help' tells more. First steps: incognita demo hydrant",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
