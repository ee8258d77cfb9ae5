"""The panels beside the scene: what a person can do, and what the robot says in words."""

from collections import deque

import numpy as np
import viser
from viser import uplot

from robots.colours import BLUE
from schemas import topics
from schemas.belief import MapBelief
from schemas.geometry import Pose2
from web import reports
from web.camera_view import annotated
from web.colours import css
from web.focus_words import focus_html
from web.question_box import QuestionBox
from web.requests import LONGEST_INSTRUCTION, Cancel, Inbox, Release, Say, Stop, means_stop
from web.understood import understood_html
from web.view_model import ViewModel
from web.viewpoints import VIEWPOINTS, viewpoint

Switches = dict[str, viser.FrameHandle]
"""What can be hidden, by the title of its switch."""

_slow_period_ns = 500_000_000
_stop_colour = (201, 28, 34)
_history = 240
_left_width, _right_width = 370, 350
_no_picture = np.full((48, 64, 3), 232, np.uint8)


class Panels:
    """All widgets. Their callbacks run in other threads and do nothing but fill the inbox."""

    def __init__(self, server: viser.ViserServer, inbox: Inbox, layers: Switches) -> None:
        self._inbox = inbox
        self._shown: dict[int, str] = {}
        self._slow_ns = 0
        self._map_from_base = Pose2(0.0, 0.0, 0.0)
        self._picture: object = None
        self._effective: deque[tuple[float, float]] = deque(maxlen=_history)
        self._belief: MapBelief | None = None
        self._build_left(server.gui)
        self._build_right(server.gui, layers)

    def greet(self, client: viser.ClientHandle) -> None:
        """Give a browser its own instruction form: a shared one would show what others type."""
        self._question.greet(client)
        gui, number = client.gui, client.client_id
        with gui.add_form(None, order=3) as form:
            text = gui.add_text("Say", "", hint="Enter sends")
            send = gui.add_button("Send", icon=viser.Icon.SEND, hint="Enter sends too")
        send.on_click(lambda _: form.submit())

        @form.on_submit
        def _submit(_: object) -> None:
            said = text.value.strip()
            text.value = ""
            if len(said) > LONGEST_INSTRUCTION:
                client.add_notification("Too long", f"{LONGEST_INSTRUCTION} letters are the limit")
            elif means_stop(said):
                self._inbox.put(Stop(number))
            elif said:
                self._inbox.put(Say(said, number))

    def leave(self, client: viser.ClientHandle) -> None:
        """Forget a browser that has gone."""
        self._question.leave(client)

    def _look(self, event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
        """Move the camera of the one who asked."""
        if event.client is None:
            return
        position, target = viewpoint(event.target.value, self._map_from_base)
        with event.client.atomic():
            event.client.camera.position = position
            event.client.camera.look_at = target

    def show(self, view: ViewModel) -> None:
        """Bring all panels up to date; what did not change costs nothing."""
        self._map_from_base = view.map_from_base
        self._release.visible = view.stopped
        self._cancel.visible = view.active
        self._question.show(view.asked)
        self._show_words(view)
        self._show_picture(view)
        if view.now_ns - self._slow_ns >= _slow_period_ns:
            self._slow_ns = view.now_ns
            self._show_slowly(view)

    def _build_left(self, gui: viser.GuiApi) -> None:
        self.stop = gui.add_button(
            "STOP", order=0, color=_stop_colour, icon=viser.Icon.HAND_STOP, hint="Esc stops too"
        )
        self.stop.on_click(lambda event: self._inbox.put(Stop(event.client_id or 0)))
        self._pills = gui.add_html("", order=1)
        self._release = gui.add_button("Release stop", order=2, color="orange", visible=False)
        self._release.on_click(lambda event: self._inbox.put(Release(event.client_id or 0)))
        self._cancel = gui.add_button("Cancel instruction", order=4, color="gray", visible=False)
        self._cancel.on_click(lambda event: self._inbox.put(Cancel(event.client_id or 0)))
        self._question = QuestionBox(gui, self._inbox)
        tabs = gui.add_tab_group(order=5)
        with tabs.add_tab("Understood", viser.Icon.MESSAGE):
            self._understood = gui.add_html("")
        with tabs.add_tab("Log", viser.Icon.LIST):
            self._log = gui.add_html("")
        gui.main_panel.dock_left()
        gui.main_panel.set_width(_left_width)

    def _build_right(self, gui: viser.GuiApi, layers: Switches) -> None:
        panel = gui.add_panel()
        with panel.add_tab("Belief", viser.Icon.CHART_HISTOGRAM):
            self._where = gui.add_html("")
            self._camera = gui.add_image(_no_picture, label="camera", jpeg_quality=80)
            self._attended = gui.add_html("")
            self._plot = _effective_plot(gui)
        with panel.add_tab("Layers", viser.Icon.STACK_2):
            views = gui.add_button_group("View", VIEWPOINTS)
            views.on_click(self._look)
            for title, frame in layers.items():
                _add_switch(gui, title, frame)
        with panel.add_tab("Health", viser.Icon.HEART_RATE_MONITOR):
            self._health = gui.add_html("")
        panel.dock_right()
        panel.set_width(_right_width)

    def _show_words(self, view: ViewModel) -> None:
        text = understood_html(
            view.get(topics.INSTRUCTION),
            view.get(topics.ANNOTATIONS),
            view.get(topics.INSTRUCTION_STATUS),
            view.get(topics.DECISION),
        )
        self._set(self._understood, text)
        self._set(self._log, reports.log_html(list(view.events.events), view.start_ns))

    def _show_slowly(self, view: ViewModel) -> None:
        self._set(self._pills, reports.pills_html(view))
        self._set(self._health, reports.health_html(view))
        belief = view.get(topics.BELIEF)
        self._set(self._where, reports.belief_html(belief))
        if belief is not None and belief is not self._belief:
            self._belief = belief
            seconds = (belief.stamp_ns - view.start_ns) / 1e9
            share = 100 * belief.effective_particles / len(belief.weights)
            self._effective.append((seconds, share))
            history = np.array(self._effective)
            self._plot.data = (history[:, 0], history[:, 1])

    def _show_picture(self, view: ViewModel) -> None:
        shot = view.picture()
        if shot is None:
            return
        age = view.age_s(topics.RGBD)
        label = (
            f"camera, {view.rate_hz(topics.RGBD):.0f} Hz" if age < 2 else "camera, no new picture"
        )
        if self._camera.label != label:
            self._camera.label = label
        shown = (shot.frame.stamp_ns, shot.detections is not None)
        if shown != self._picture:
            self._picture = shown
            self._camera.image = annotated(shot)
            self._set(self._attended, focus_html(shot.focus))

    def _set(self, slot: viser.GuiHtmlHandle, text: str) -> None:
        if self._shown.get(id(slot)) != text:
            self._shown[id(slot)] = text
            slot.content = text


def _effective_plot(gui: viser.GuiApi) -> viser.GuiUplotHandle:
    empty = np.zeros(1)
    return gui.add_uplot(
        (empty, empty),
        (
            uplot.Series(label="time"),
            uplot.Series(label="maps", stroke=css(BLUE), width=2, fill=css(BLUE) + "22"),
        ),
        title="effective share of the maps, %",
        height=140,
        scales={"x": uplot.Scale(time=False), "y": uplot.Scale(range=(0, 105))},
        legend=uplot.Legend(show=False),
    )


def _add_switch(gui: viser.GuiApi, title: str, frame: viser.FrameHandle) -> None:
    switch = gui.add_checkbox(title, initial_value=True)

    @switch.on_update
    def _toggle(_: object) -> None:
        frame.visible = switch.value
