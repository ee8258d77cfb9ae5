"""Small pieces of HTML. Texts are escaped here; nobody else puts them into HTML."""

from collections.abc import Iterable
from html import escape

from robots.colours import Rgb
from web.colours import css

GOOD: Rgb = (0, 121, 90)
WARN: Rgb = (154, 91, 0)
BAD: Rgb = (179, 38, 30)
CALM: Rgb = (31, 119, 180)
QUIET: Rgb = (91, 100, 114)


def pill(text: str, colour: Rgb) -> str:
    """White words on a coloured lozenge."""
    style = (
        f"background:{css(colour)};color:#fff;border-radius:999px;padding:1px 9px;"
        "font-size:11px;font-weight:700;letter-spacing:.03em;white-space:nowrap"
    )
    return f'<span style="{style}">{escape(text)}</span>'


def heading(text: str) -> str:
    """A small grey line above a group."""
    style = "font-size:11px;color:#5b6472;margin:10px 0 3px"
    return f'<div style="{style}">{escape(text)}</div>'


def paragraph(text: str, colour: Rgb | None = None) -> str:
    """One line of text."""
    tint = f"color:{css(colour)};" if colour else ""
    return f'<div style="{tint}font-size:12.5px;line-height:1.45">{escape(text)}</div>'


def bar(label: str, share: float, colour: Rgb) -> str:
    """A labelled bar from 0 to 1, with the number beside it."""
    text, width = escape(label), 100 * min(max(share, 0.0), 1.0)
    name_style = "flex:0 0 58%;padding-right:8px;line-height:1.25;overflow-wrap:anywhere"
    return (
        '<div style="display:flex;align-items:center;margin:3px 0;font-size:12.5px">'
        f'<div style="{name_style}" title="{text}">{text}</div>'
        '<div style="flex:1;background:#e6e8ec;border-radius:3px;height:11px" role="meter" '
        f'aria-label="{text}" aria-valuenow="{share:.2f}">'
        f'<div style="width:{width:.0f}%;height:11px;border-radius:3px;background:{css(colour)}">'
        '</div></div><div style="width:36px;text-align:right;'
        f'font-variant-numeric:tabular-nums">{share:.2f}</div></div>'
    )


def word(text: str, role: str, colour: Rgb) -> str:
    """A word of the sentence, underlined, with what it was taken for beneath."""
    return (
        '<span style="display:inline-block;vertical-align:top;margin:2px 9px 6px 0;'
        f'border-bottom:3px solid {css(colour)};padding-bottom:2px;line-height:1.2">'
        f'<b style="font-size:14px">{escape(text)}</b><br>'
        f'<span style="font-size:10.5px;color:#5b6472">{escape(role) or "&nbsp;"}</span></span>'
    )


def swatch(label: str, colour: Rgb, *, outline: bool = False, opacity: float = 1.0) -> str:
    """One entry of a legend."""
    fill = f"border:2px solid {css(colour)}" if outline else f"background:{css(colour)}"
    box = (
        f"display:inline-block;width:11px;height:11px;box-sizing:border-box;{fill};"
        f"opacity:{opacity};border-radius:2px;margin-right:4px;vertical-align:-1px"
    )
    return f'<span style="white-space:nowrap"><span style="{box}"></span>{escape(label)}</span>'


def flow(parts: Iterable[str]) -> str:
    """Pieces side by side, wrapped where the panel ends."""
    style = "display:flex;flex-wrap:wrap;gap:3px 12px;font-size:12px;align-items:center"
    return f'<div style="{style}">{"".join(parts)}</div>'


def table(head: Iterable[str], rows: Iterable[Iterable[tuple[str, Rgb | None]]]) -> str:
    """A table; a cell is a text and its colour."""
    names = "".join(f'<th style="font-weight:500">{escape(name)}</th>' for name in head)
    body = "".join(f'<tr style="border-top:1px solid #e1e4e8">{_cells(row)}</tr>' for row in rows)
    return (
        '<table style="width:100%;font-size:12px;border-collapse:collapse;'
        'font-variant-numeric:tabular-nums"><tr style="color:#5b6472;text-align:left">'
        f"{names}</tr>{body}</table>"
    )


def padded(*parts: str) -> str:
    """Pieces one below the other, with the margins of a panel."""
    return f'<div style="padding:2px 12px 8px">{"".join(parts)}</div>'


def _cells(row: Iterable[tuple[str, Rgb | None]]) -> str:
    return "".join(
        f'<td style="padding:3px 4px 3px 0;{_tint(colour)}">{escape(text)}</td>'
        for text, colour in row
    )


def _tint(colour: Rgb | None) -> str:
    return f"color:{css(colour)};font-weight:600" if colour else ""
