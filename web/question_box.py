"""Where a person answers the robot: a button for each short answer, and a line to type."""

import viser

from schemas.language import Annotations
from web import markup
from web.requests import LONGEST_INSTRUCTION, Inbox, Reply

_order = 3.5
"""Below the line for instructions, above the button that cancels."""


class QuestionBox:
    """Shown while a question is open. Its callbacks do nothing but fill the inbox."""

    def __init__(self, gui: viser.GuiApi, inbox: Inbox) -> None:
        self._gui = gui
        self._inbox = inbox
        self._open: tuple[str, str] | None = None
        self._buttons: list[viser.GuiButtonHandle] = []
        self._forms: dict[int, viser.GuiFormHandle] = {}
        self._text = gui.add_html("", order=_order, visible=False)

    def greet(self, client: viser.ClientHandle) -> None:
        """Give a browser its own line: a shared one would show what others type."""
        gui, number = client.gui, client.client_id
        form = gui.add_form(None, order=_order + 0.2, visible=self._open is not None)
        with form:
            text = gui.add_text("Answer", "", hint="Enter sends")
        self._forms[number] = form

        @form.on_submit
        def _submit(_: object) -> None:
            said = text.value.strip()
            text.value = ""
            if said and len(said) <= LONGEST_INSTRUCTION:
                self.answer(said, number)

    def leave(self, client: viser.ClientHandle) -> None:
        """Forget a browser that has gone."""
        self._forms.pop(client.client_id, None)

    @property
    def buttons(self) -> tuple[viser.GuiButtonHandle, ...]:
        """One for each short answer to the open question."""
        return tuple(self._buttons)

    def answer(self, text: str, client: int) -> None:
        """Somebody answers; too late if the question is no longer open."""
        if self._open is not None:
            self._inbox.put(Reply(text, self._open[0], client))

    def show(self, asked: Annotations | None) -> None:
        """Show the open question, or hide everything where there is none."""
        now = (asked.instruction_id, asked.question) if asked and asked.question else None
        if now == self._open:
            return
        self._open = now
        self._text.visible = now is not None
        for form in list(self._forms.values()):
            form.visible = now is not None
        for button in self._buttons:
            button.remove()
        self._buttons = [self._button(option) for option in asked.options] if asked and now else []
        if now is not None:
            question = markup.paragraph(now[1], markup.WARN)
            self._text.content = markup.padded(markup.heading("I have a question"), question)

    def _button(self, option: str) -> viser.GuiButtonHandle:
        button = self._gui.add_button(option, order=_order + 0.1, color="gray")
        button.on_click(lambda event: self.answer(option, event.client_id or 0))
        return button
