"""What was said, understood, decided and what failed, line by line."""

from collections.abc import Iterable

from foxglove_schemas_protobuf.Log_pb2 import Log

from schemas.health import Fault
from schemas.language import Annotations, Answer, Instruction
from schemas.motion import StopLatch
from schemas.task import CancelRequest, Decision, InstructionStatus, TaskState
from services.recorder.viewer.parts import time_of


def instruction(said: Instruction) -> Log:
    """Words of a person."""
    return _line(said.stamp_ns, said.source, said.text)


def answer(said: Answer) -> Log:
    """Words of a person."""
    return _line(said.stamp_ns, said.source, said.text)


def understood(meaning: Annotations) -> Iterable[Log]:
    """What it was understood to mean, and what is asked."""
    for one in meaning.annotations[:1]:
        relations = ", ".join(f"{r.figure} {r.relation} {r.landmark}" for r in one.relations)
        text = f"{', '.join(one.objects)}: {relations} ({one.probability:.2f})"
        yield _line(meaning.stamp_ns, "grounding", text)
    if meaning.unknown_words:
        text = f"unknown words: {', '.join(meaning.unknown_words)}"
        yield _line(meaning.stamp_ns, "grounding", text, Log.WARNING)
    if meaning.question is not None:
        yield _line(meaning.stamp_ns, "grounding", meaning.question)


def decided(decision: Decision) -> Log:
    """The policy's reason."""
    return _line(decision.stamp_ns, "policy", decision.reason)


def progress(status: InstructionStatus) -> Log:
    """How far an instruction is."""
    level = Log.ERROR if status.state is TaskState.FAILED else Log.INFO
    return _line(status.stamp_ns, "policy", f"{status.state.value}: {status.reason}", level)


def fault(of: Fault) -> Log:
    """What went wrong."""
    return _line(of.stamp_ns, of.node, f"{of.what}: {of.detail}", Log.ERROR)


def stop(latch: StopLatch) -> Log:
    """All motion is stopped, or free again."""
    text = "stopped" if latch.stopped else "stop released"
    return _line(latch.stamp_ns, latch.source, text, Log.WARNING)


def cancel(request: CancelRequest) -> Log:
    """The instruction is dropped."""
    return _line(request.stamp_ns, request.source, "cancelled", Log.WARNING)


def _line(stamp_ns: int, name: str, text: str, level: "Log.Level.ValueType" = Log.INFO) -> Log:
    return Log(timestamp=time_of(stamp_ns), level=level, message=text, name=name)
