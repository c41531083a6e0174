# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A self-contained HTML page. What is given as ``str`` is text and gets escaped; ``Markup`` is HTML."""

from __future__ import annotations

import base64
import html
from collections.abc import Iterable, Sequence
from importlib import resources

import cv2

from vigg_ros.pictures import Picture

JPEG_QUALITY = 80

# Whatever a bag holds, the page loads nothing and runs nothing.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"


class Markup(str):
    """HTML that is fit to be put into the page."""

    __slots__ = ()


def text(content: object) -> Markup:
    """Anything as HTML: Markup as it is, everything else escaped; control characters are shown as boxes."""
    if isinstance(content, Markup):
        return content
    shown = "".join(c if c.isprintable() or c == "\n" else "\N{WHITE SQUARE}" for c in str(content))
    return Markup(html.escape(shown))


def element(tag: str, *contents: object, **attributes: str) -> Markup:
    """An element with escaped contents; ``class_`` stands for class."""
    said = "".join(f' {name.rstrip("_")}="{html.escape(value)}"' for name, value in attributes.items())
    return Markup(f"<{tag}{said}>{''.join(map(text, contents))}</{tag}>")


def section(title: str, *contents: object) -> Markup:
    """A part of the page with its heading."""
    return element("section", element("h2", title), *contents)


def table(heading: Sequence[object], rows: Iterable[Sequence[object]], *, narrow: bool = False) -> Markup:
    """A table whose cells may be text or Markup; ``narrow`` keeps all but the last two columns on one line."""
    head = element("tr", *(element("th", cell) for cell in heading))
    body = (element("tr", *(element("td", cell) for cell in row)) for row in rows)
    content = element("table", element("thead", head), element("tbody", *body))
    return element("div", content, class_="scroll narrow" if narrow else "scroll")


def tile(title: str, figure: str, said: str) -> Markup:
    """A figure that should be seen first, with what it means."""
    return element("div", element("h3", title), element("b", figure), element("p", said), class_="tile")


def plot(svg: str, caption: object) -> Markup:
    """A plot with its caption."""
    return element("figure", Markup(svg), element("figcaption", caption))


def image(picture: Picture, description: str) -> Markup:
    """A picture inside the page, as JPEG."""
    done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    assert done, "OpenCV encodes every 8-bit picture as JPEG"
    uri = "data:image/jpeg;base64," + base64.b64encode(data.tobytes()).decode()
    height_px, width_px = picture.shape[:2]
    size = f'width="{width_px}" height="{height_px}"'
    return Markup(f'<img src="{uri}" alt="{html.escape(description)}" {size}>')


def page(title: str, *contents: object) -> str:
    """The whole page."""
    style = resources.files("vigg_ros.report").joinpath("report.css").read_text(encoding="utf-8")
    head = (
        '<meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{html.escape(_POLICY)}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        '<meta name="color-scheme" content="light dark">'
        f"<title>{text(title)}</title><style>{style}</style>"
    )
    body = element("main", *contents)
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>{body}</body></html>\n'
