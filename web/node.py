"""The page as a node: it listens to everything worth seeing and speaks when a person acts."""

from collections.abc import Iterable
from functools import partial
from typing import Any

import numpy as np
from msgspec import Struct

from robots.catalogue import get_robot
from schemas import topics
from schemas.health import Tick
from schemas.run import RunConfig
from schemas.topics import Handlers, Output, Topic
from services.process_table import process_named
from web.app import App
from web.requests import message_for
from web.view_model import ViewModel

_displayed = tuple(topic for topic in process_named("web").listens if topic is not topics.TICK)


class WebNode:
    """Every tick: what people did becomes messages, and what is known goes to their browsers."""

    def __init__(self, run: RunConfig, rng: np.random.Generator) -> None:
        self._view = ViewModel(run.start_ns)
        self.app = App(get_robot(run.robot), run.web_port, run.web_token)
        self.app.start()

    def handlers(self) -> Handlers:
        """All topics that are shown, and the tick at which they are."""
        return {topic: partial(self._keep, topic) for topic in _displayed} | {
            topics.TICK: self.on_tick
        }

    def on_tick(self, tick: Tick) -> Iterable[Output]:
        """Send what people asked for, then draw."""
        self._view.tick(tick.stamp_ns)
        outputs = [
            output
            for k, wish in enumerate(self.app.inbox.drain())
            if (output := message_for(wish, tick.stamp_ns + k))
        ]
        for output in outputs:
            self._view.put(output.topic, output.message)
        self.app.show(self._view)
        return outputs

    def close(self) -> None:
        """Close the page."""
        self.app.stop()

    def _keep(self, topic: Topic[Any], message: Struct) -> Iterable[Output]:
        self._view.put(topic, message)
        return ()
