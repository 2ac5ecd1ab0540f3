"""Pictures as text inside the page: SVG as markup with names of its own, PNG as compact data URIs."""

from __future__ import annotations

import io
import re
from base64 import b64encode
from html import escape
from pathlib import Path

WEBP_QUALITY, WEBP_EFFORT = 88, 4
"""The highest effort, 6, takes twice the time for one or two percent of the bytes."""


def inline_svg(path: Path, key: str, alternative: str) -> str:
    """The markup of an SVG file for use inside a page, as wide as its container.

    path : SVG file as Matplotlib writes it
    key : put before every name in it, since names must be unique on a page
    alternative : what the picture shows, for readers who do not see it
    """
    text = path.read_text(encoding="utf-8")
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r'\bid="([^"]+)"', rf'id="{key}-\1"', text)
    text = re.sub(r'(href="#|url\(#)', rf"\g<1>{key}-", text)
    head, body = text.split(">", 1)
    head = re.sub(r'\s(?:width|height)="[^"]*"', "", head)
    return f'{head} role="img" aria-label="{escape(alternative)}">{body}'.strip()


def data_uri(path: Path) -> str:
    """An image file as a data URI, as WebP: a quarter of the bytes of a shaded PNG.

    path : PNG file
    """
    from PIL import Image

    buffer = io.BytesIO()
    with Image.open(path) as image:
        image.convert("RGB").save(buffer, "WEBP", quality=WEBP_QUALITY, method=WEBP_EFFORT)
    return "data:image/webp;base64," + b64encode(buffer.getvalue()).decode()


def image_size(path: Path) -> tuple[int, int]:
    """Width and height of an image file in pixels.

    path : PNG file
    """
    from PIL import Image

    with Image.open(path) as image:
        return image.size
