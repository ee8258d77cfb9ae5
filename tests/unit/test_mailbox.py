"""Laws of the mailbox: order, replacement, and honest counting."""

import dataclasses
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from schemas import topics
from schemas.topics import Qos, Topic
from services.runtime.mailbox import KEPT_BYTES, Mailbox, Sample

watched: list[Topic[Any]] = [topics.STOP, topics.ODOMETRY, topics.SCAN, topics.INSTRUCTION]


def sample(topic: Topic[Any], sequence: int, publisher: int = 1) -> Sample:
    return Sample(topic, b"", publisher, sequence, 0)


def drained(mailbox: Mailbox) -> list[Sample]:
    return [taken for _ in range(len(mailbox)) if (taken := mailbox.take()) is not None]


@given(st.lists(st.sampled_from(watched), max_size=40))
def test_never_drop_comes_first_by_rank_and_only_what_was_replaced_is_lost(
    arrivals: list[Topic[Any]],
) -> None:
    mailbox = Mailbox(watched)
    for sequence, topic in enumerate(arrivals):
        mailbox.put(sample(topic, sequence))
    taken = drained(mailbox)
    urgencies = [entry.topic.rank if entry.topic.qos is Qos.NEVER_DROP else 1000 for entry in taken]
    assert urgencies == sorted(urgencies)
    for topic in set(arrivals):
        came = [k for k, arrived in enumerate(arrivals) if arrived is topic]
        kept = came[-1:] if topic.qos is Qos.LATEST_WINS else came
        assert [entry.sequence for entry in taken if entry.topic is topic] == kept
    assert len(taken) + mailbox.replaced == len(arrivals)


def test_a_fast_stream_does_not_starve_a_slow_one() -> None:
    mailbox = Mailbox(watched)
    mailbox.put(sample(topics.ODOMETRY, 0))
    mailbox.put(sample(topics.SCAN, 0))
    mailbox.take()
    mailbox.put(sample(topics.ODOMETRY, 1))
    taken = mailbox.take()
    assert taken is not None
    assert taken.topic is topics.SCAN


def test_gaps_are_losses_of_never_drop_topics_only() -> None:
    mailbox = Mailbox(watched)
    for sequence in (0, 1, 4):
        mailbox.put(sample(topics.INSTRUCTION, sequence))
        mailbox.put(sample(topics.ODOMETRY, sequence))
    assert mailbox.lost == 2


def test_a_repeat_is_refused_and_a_new_publisher_is_not() -> None:
    mailbox = Mailbox(watched)
    assert mailbox.put(sample(topics.STOP, 0))
    assert not mailbox.put(sample(topics.STOP, 0))
    assert mailbox.put(sample(topics.STOP, 0, publisher=2))
    assert mailbox.lost == 0


def test_a_full_never_drop_queue_lets_the_oldest_go_and_counts_it() -> None:
    mailbox = Mailbox(watched)
    for sequence in range(topics.STOP.queue + 3):
        mailbox.put(sample(topics.STOP, sequence))
    assert mailbox.lost == 3
    assert drained(mailbox)[0].sequence == 3


def test_keeping_all_treats_every_topic_as_never_drop() -> None:
    mailbox = Mailbox(watched, keep_all=True)
    for sequence in (0, 1, 3):
        mailbox.put(sample(topics.ODOMETRY, sequence))
    assert [entry.sequence for entry in drained(mailbox)] == [0, 1, 3]
    assert mailbox.lost == 1


def test_keeping_all_holds_what_arrives_while_nobody_takes_up_to_a_size() -> None:
    mailbox = Mailbox(watched, keep_all=True)
    large = bytes(KEPT_BYTES // 10)
    for sequence in range(5000):
        mailbox.put(sample(topics.ODOMETRY, sequence))
    for sequence in range(13):
        mailbox.put(dataclasses.replace(sample(topics.SCAN, sequence), payload=large))
    taken = drained(mailbox)
    assert [one.sequence for one in taken if one.topic is topics.ODOMETRY] == list(range(5000))
    assert [one.sequence for one in taken if one.topic is topics.SCAN] == list(range(3, 13))
    assert mailbox.lost == 3
