"""What perception attends to, in words."""

from schemas.perception import Focus
from web import markup


def line_over(focus: Focus) -> str:
    """What to write over a picture that was not looked at; "" for one that was."""
    return f"frame skipped: {focus.reason}" if focus.reason else ""


def focus_html(focus: Focus | None) -> str:
    """The lines below the picture; nothing where perception looks at everything alike."""
    if focus is None:
        return ""
    lines = [f"Looking for {', '.join(focus.wanted)}" if focus.wanted else "Nothing to look for"]
    if focus.unsought:
        lines.append(f"Not looked for in this picture: {', '.join(focus.unsought)}")
    if len(focus.passed_px):
        lines.append(f"Passed over {_things(len(focus.passed_px))} that showed none of it before")
    saved = f"{100 * focus.saved:.0f} % of the networks' work saved"
    lines.append(f"{saved}; this picture took {100 * focus.work:.0f} %")
    return markup.padded(*(markup.paragraph(line, markup.QUIET) for line in lines))


def _things(count: int) -> str:
    return "one thing" if count == 1 else f"{count} things"
