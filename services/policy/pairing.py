"""Brings together a belief and the behaviours that were inferred in it."""

from schemas.belief import MapBelief
from schemas.language import Behaviors
from services.policy.referents import Referents, from_behaviors, from_figures

_held = 8
"""Beliefs that may wait for their behaviours."""
_patience_ns = 1_000_000_000
"""So long after the last behaviours the belief is used without [ns]."""
_entering_ns = 2_000_000_000
"""So long the utterance may take to enter the belief as evidence [ns]."""

Reading = tuple[MapBelief, Referents]


class Pairing:
    """Matches the two streams by the stamp of the belief, whichever comes first.

    Behaviours of another instruction, and figures grounded for another utterance, say nothing
    about this one and are not used.
    """

    def __init__(self, instruction_id: str, started_ns: int) -> None:
        self._instruction_id = instruction_id
        self._started_ns = started_ns
        self._beliefs: dict[int, MapBelief] = {}
        self._behaviors: Behaviors | None = None
        self._matched_ns = started_ns

    def take_belief(self, belief: MapBelief) -> Reading | None:
        """What to decide on now, if anything."""
        if not self._has_entered(belief):
            return None
        self._beliefs[belief.stamp_ns] = belief
        while len(self._beliefs) > _held:
            del self._beliefs[next(iter(self._beliefs))]
        matched = self._match()
        if matched or belief.stamp_ns - self._matched_ns < _patience_ns:
            return matched
        if belief.instruction_id != self._instruction_id:
            return None
        return belief, from_figures(belief)

    def take_behaviors(self, behaviors: Behaviors) -> Reading | None:
        """What to decide on now, if anything."""
        if behaviors.instruction_id != self._instruction_id:
            return None
        self._behaviors = behaviors
        return self._match()

    def _has_entered(self, belief: MapBelief) -> bool:
        """Another utterance may have followed, so that the id alone does not tell."""
        late = belief.stamp_ns - self._started_ns > _entering_ns
        return late or belief.instruction_id == self._instruction_id

    def _match(self) -> Reading | None:
        behaviors = self._behaviors
        if behaviors is None or behaviors.stamp_ns not in self._beliefs:
            return None
        belief = self._beliefs.pop(behaviors.stamp_ns)
        self._behaviors, self._matched_ns = None, belief.stamp_ns
        return belief, from_behaviors(belief, behaviors)
