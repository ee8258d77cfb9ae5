"""Records what a service hears. Import it after `sim.vulkan.activate()`."""

from collections.abc import Iterator

from schemas import topics
from schemas.language import Instruction
from services.runtime.lockstep import Lockstep
from services.runtime.mailbox import Sample
from sim.experiments.assembly import modelled_assembly, table_assembly
from sim.experiments.perception_model import PerceptionSettings
from tests.replay.cases import Case

_said_at_ns = 1_000_000_000


def recorded(case: Case) -> list[Sample]:
    """What the service hears in an episode in lockstep."""
    heard: list[Sample] = []
    built = (
        table_assembly(case.run)
        if case.drawn
        else modelled_assembly(case.run, PerceptionSettings())
    )
    lockstep = Lockstep(
        built.nodes,
        on_handled=lambda name, sample: name == case.service and heard.append(sample),
    )
    lockstep.run(_said_at_ns)
    said = Instruction(stamp_ns=lockstep.now_ns, id="1", text=case.text, source="test")
    lockstep.send(topics.INSTRUCTION.of(said))
    lockstep.run(round(1e9 * case.seconds))
    lockstep.close()
    return list(_thinned(case, heard))


def _thinned(case: Case, heard: list[Sample]) -> Iterator[Sample]:
    counts: dict[str, int] = {}
    for sample in heard:
        number = counts.get(sample.topic.key, 0)
        counts[sample.topic.key] = number + 1
        if number % case.every.get(sample.topic, 1) == 0:
            yield sample
