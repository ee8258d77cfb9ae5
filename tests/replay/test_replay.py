"""Each service says to recorded inputs what it said before, field by field."""

import dataclasses

import msgspec
import pytest

from schemas.codec import decode, encode
from tests.replay.__main__ import check
from tests.replay.cases import CASES, LOGS, Case
from tests.replay.comparing import differences
from tests.replay.running import Step, stored

by_name = {case.name: case for case in CASES}
said_elsewhere = {"fault", "scene", "wrist/bodies", "wrist/detections"}
"""Nothing is wrong in a recording; kinds of places are told by modelled perception, and what the
wrist's camera sees is the subject of tests/unit/test_perception_wrist.py."""


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_service_says_what_it_said(case: Case):
    found = check(case)
    wanted = f"if that is wanted: python -m tests.replay bless {case.name}"
    assert not found, "\n".join([*found[:10], wanted])


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_every_topic_of_a_service_is_in_its_recordings(case: Case):
    """A case that says nothing would pass whatever the service does."""
    assert topics_of(case), case.name
    same_service = [other for other in CASES if other.service == case.service]
    covered = set().union(*(topics_of(other) for other in same_service))
    assert not {topic.key for topic in case.process.publishes} - covered - said_elsewhere


def topics_of(case: Case) -> set[str]:
    return {sample.topic.key for step in stored(case) for sample in step.said}


def test_recordings_are_small_and_none_is_left_over():
    assert {path.stem for path in LOGS.iterdir()} == by_name.keys()
    assert all(case.path.stat().st_size < 600_000 for case in CASES)


def changed(step: Step, **fields: object) -> Step:
    first, *rest = step.said
    message = msgspec.structs.replace(decode(first.payload, first.topic.type), **fields)
    return Step(step.heard, [dataclasses.replace(first, payload=encode(message)), *rest])


def test_a_field_that_differs_is_found_and_named():
    step = next(step for step in stored(by_name["navigation"]) if step.said)
    speed = decode(step.said[0].payload, step.said[0].topic.type).linear
    assert differences([step], [changed(step, linear=speed + 1e-9)]) == []
    (line,) = differences([step], [changed(step, linear=speed + 0.01)])
    assert "base/command.linear" in line
    (line,) = differences([step], [Step(step.heard, step.said[1:])])
    assert "before ['base/command" in line


def test_arrays_are_compared_number_by_number():
    steps = stored(by_name["mapping"])
    step = next(s for s in steps if s.said and s.said[0].topic.key == "map/belief")
    belief = decode(step.said[0].payload, step.said[0].topic.type)
    weights = belief.weights.copy()
    weights[3] += 0.01
    (line,) = differences([step], [changed(step, weights=weights)])
    assert "weights[3]" in line
    (line,) = differences([step], [changed(step, figure=belief.figure + 1)])
    assert "figure[0]" in line
