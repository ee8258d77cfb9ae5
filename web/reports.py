"""The panels in words and tables: state, log, belief, health."""

import math
from typing import Any

from robots.colours import Rgb, class_colour
from schemas import topics
from schemas.belief import MapBelief
from schemas.geometry import Pose2
from schemas.health import ServiceHealth, ServiceState
from schemas.topics import Topic
from web import markup
from web.belief_model import Mode, modes, observed
from web.events import Event
from web.phrases import direction
from web.view_model import ViewModel

_lines_shown = 80
_event_colours: dict[str, Rgb] = {
    "said": markup.CALM,
    "stop": markup.BAD,
    "fault": markup.BAD,
    "status": markup.GOOD,
    "saw": class_colour("barrel"),
}
_state_marks: dict[ServiceState, tuple[str, Rgb]] = {
    ServiceState.RUNNING: ("●", markup.GOOD),
    ServiceState.STARTING: ("▲", markup.WARN),
    ServiceState.RESTARTING: ("▲", markup.WARN),
    ServiceState.HUNG: ("✕", markup.BAD),
    ServiceState.FAILED: ("✕", markup.BAD),
    ServiceState.STOPPED: ("✕", markup.QUIET),
    ServiceState.AWAY: ("✕", markup.BAD),
}
_streams: tuple[tuple[str, Topic[Any]], ...] = (
    ("odometry", topics.ODOMETRY),
    ("laser", topics.SCAN),
    ("camera", topics.RGBD),
    ("detections", topics.DETECTIONS),
    ("grid", topics.GRID),
    ("belief", topics.BELIEF),
)
_silent_periods = 3.0
_least_silence_s = 1.5
"""Perception may be silent for a second while nothing changes [s]."""


def pills_html(view: ViewModel) -> str:
    """The state of everything in one row."""
    pills = [_liveness(view), *_motion(view), *_services(view)]
    return markup.padded(markup.flow(pills))


def log_html(events: list[Event], start_ns: int) -> str:
    """The newest events, newest first, at the time since the run began."""
    return markup.padded(*(_line(event, start_ns) for event in events[::-1][:_lines_shown]))


def belief_html(belief: MapBelief | None) -> str:
    """Legend, and where the thing that was meant may be."""
    if belief is None:
        return markup.padded(markup.paragraph("No belief yet: the map service has not spoken."))
    return markup.padded(_legend(belief), *_where(belief))


def health_html(view: ViewModel) -> str:
    """Services as their supervisor sees them, and the age of every stream as this page sees it."""
    parts = [markup.heading("Services"), _service_table(view)]
    parts += [markup.heading("What reaches this page"), _stream_table(view)]
    return markup.padded(*parts)


def place(mode: Mode, map_from_base: Pose2) -> str:
    """Where a mode is, as seen from the robot."""
    at = map_from_base.inverse().apply(mode.mean)
    bearing = math.degrees(math.atan2(at[1], at[0]))
    return f"{math.hypot(*at):.1f} m {direction(bearing)}"


def _liveness(view: ViewModel) -> str:
    age = view.age_s(topics.ODOMETRY)
    if math.isinf(age):
        return markup.pill("WAITING FOR ROBOT", markup.WARN)
    if view.live:
        return markup.pill("LIVE", markup.CALM)
    return markup.pill(f"STALE {_age(age)}", markup.BAD)


def _motion(view: ViewModel) -> list[str]:
    odometry = view.get(topics.ODOMETRY)
    if view.stopped:
        return [markup.pill("STOPPED", markup.BAD)]
    if odometry is None or not view.live:
        return []
    state = (
        markup.pill("MOVING", markup.GOOD) if view.moving else markup.pill("STILL", markup.QUIET)
    )
    return [state, markup.pill(f"{abs(odometry.linear):.1f} m/s", markup.QUIET)]


def _services(view: ViewModel) -> list[str]:
    status = view.get(topics.SYSTEM_STATUS)
    if status is None:
        return []
    down = [s.name for s in status.services if s.state is not ServiceState.RUNNING]
    if down:
        return [markup.pill(f"{', '.join(down)} down", markup.BAD)]
    return [markup.pill(f"{len(status.services)} SERVICES OK", markup.QUIET)]


def _line(event: Event, start_ns: int) -> str:
    seconds = max(0, event.stamp_ns - start_ns) // 1_000_000_000
    clock = f"{seconds // 60}:{seconds % 60:02d}"
    stamp = f'<span style="color:#5b6472;font-variant-numeric:tabular-nums">{clock}</span>'
    line = markup.paragraph(event.text, _event_colours.get(event.kind))
    return f'<div style="display:flex;gap:8px;font-size:12px;margin:2px 0">{stamp}{line}</div>'


def _legend(belief: MapBelief) -> str:
    shown = sorted({belief.classes[k] for k in belief.class_index})
    kinds = [
        markup.swatch("seen", markup.QUIET, outline=True),
        markup.swatch("guessed", markup.QUIET, opacity=0.35),
        markup.swatch("goal", markup.QUIET),
        markup.swatch("looked at, empty", (0, 158, 115), opacity=0.35),
    ]
    classes = [markup.swatch(name, class_colour(name)) for name in shown]
    return markup.flow(kinds) + markup.flow(classes)


def _where(belief: MapBelief) -> list[str]:
    found = modes(belief)
    if not found:
        seen = len(observed(belief))
        return [
            markup.heading("What is out there?"),
            markup.paragraph(f"{seen} objects seen; nothing said about others."),
        ]
    bars = [
        markup.bar(
            f"{'seen' if mode.seen else 'guess'}, {place(mode, belief.map_from_base)}",
            mode.mass,
            class_colour(mode.name),
        )
        for mode in found
    ]
    rest = max(0.0, 1.0 - sum(mode.mass for mode in found))
    bars.append(markup.bar("elsewhere", rest, markup.QUIET))
    return [markup.heading(f"Where is the {found[0].name}?"), *bars]


def _service_table(view: ViewModel) -> str:
    status = view.get(topics.SYSTEM_STATUS)
    if status is None:
        return markup.paragraph("No word from the supervisor yet.")
    note = ""
    if view.age_s(topics.SYSTEM_STATUS) > 4.0:
        age = _age(view.age_s(topics.SYSTEM_STATUS))
        note = markup.paragraph(f"The supervisor has been silent for {age}.", markup.BAD)
    head = ("service", "state", "rate", "age", "restarts", "lost")
    return note + markup.table(head, [_service_row(view, s) for s in status.services])


def _service_row(view: ViewModel, service: ServiceHealth) -> list[tuple[str, Rgb | None]]:
    mark, colour = _state_marks[service.state]
    losses = service.lost + service.malformed
    return [
        (service.name, None),
        (f"{mark} {service.state}", colour),
        (f"{view.service_rate_hz(service.name):.0f} Hz", None),
        (_age(service.age_s), None),
        (str(service.restarts), markup.WARN if service.restarts else None),
        (str(losses), markup.WARN if losses else None),
    ]


def _stream_table(view: ViewModel) -> str:
    return markup.table(("stream", "rate", "age"), [_stream_row(view, *s) for s in _streams])


def _stream_row(view: ViewModel, name: str, topic: Topic[Any]) -> list[tuple[str, Rgb | None]]:
    age, rate = view.age_s(topic), view.rate_hz(topic)
    late = age > max(_silent_periods / rate if rate else 0.0, _least_silence_s)
    return [
        (name, None),
        (f"{rate:.1f} Hz" if rate else "–", None),
        (_age(age), markup.BAD if late else None),
    ]


def _age(seconds: float) -> str:
    if math.isinf(seconds) or seconds < 0:
        return "never"
    return f"{seconds:.1f} s" if seconds < 100 else f"{seconds / 60:.0f} min"
