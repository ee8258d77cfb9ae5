"""Gives a service its recorded inputs, and keeps what it says."""

from collections.abc import Iterable
from dataclasses import dataclass

from schemas.codec import decode, encode
from schemas.topics import Output, topic_named
from services.runtime.log_file import read_log
from services.runtime.mailbox import Sample
from services.runtime.provenance import run_metadata
from services.runtime.record import LogWriter
from services.runtime.replay import recorded_run
from services.runtime.worker import build_node
from tests.replay.cases import Case

HEARD, SAID = 1, 2
"""Publishers in the files: the input of a step, and the outputs that follow from it."""


@dataclass(frozen=True)
class Step:
    """One input with its outputs."""

    heard: Sample
    said: list[Sample]


def stored(case: Case) -> list[Step]:
    """What the file holds, step by step."""
    steps: list[Step] = []
    for record in read_log(case.path):
        topic = topic_named(record.topic)
        number = int(record.publisher)
        sample = Sample(topic, record.data, number, record.sequence, record.log_ns)
        if number == HEARD:
            steps.append(Step(sample, []))
        else:
            steps[-1].said.append(sample)
    return steps


def replayed(case: Case, inputs: Iterable[Sample]) -> list[Step]:
    """What the service says to the inputs now."""
    node = build_node(case.process, recorded_run(case.path) if case.path.exists() else case.run)
    handlers = node.handlers()
    steps: list[Step] = []
    for number, heard in enumerate(inputs):
        message = decode(heard.payload, heard.topic.type)
        outputs = list(handlers[heard.topic](message))
        steps.append(Step(heard, [_sample(output, number) for output in outputs]))
    return steps


def store(case: Case, steps: list[Step]) -> None:
    """Write the file; its times are numbers of steps, so that its order is exact."""
    case.path.unlink(missing_ok=True)
    writer = LogWriter(case.path, {"run": run_metadata(case.run)["run"]})
    sequences: dict[tuple[int, str], int] = {}
    for number, step in enumerate(steps):
        for publisher, sample in ((HEARD, step.heard), *((SAID, said) for said in step.said)):
            key = (publisher, sample.topic.key)
            sequences[key] = sequences.get(key, -1) + 1
            kept = Sample(sample.topic, sample.payload, publisher, sequences[key], number)
            writer.write(kept, log_ns=number)
    writer.close()


def _sample(output: Output, number: int) -> Sample:
    return Sample(output.topic, encode(output.message), SAID, 0, number)
