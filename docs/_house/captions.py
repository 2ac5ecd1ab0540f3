"""Captions of tables of contents tell their level: a heading without one says nothing to a screen reader."""

from __future__ import annotations

from typing import Any

from sphinx.writers.html5 import HTML5Translator


class Translator(HTML5Translator):
    """Sphinx's own, but for the level of captions that it calls headings."""

    def starttag(self, *place: Any, **attributes: Any) -> str:
        """An opening tag; place, attributes : as Sphinx gives them."""
        if attributes.get("ROLE") == "heading":
            attributes["ARIA-LEVEL"] = "2"
        return str(super().starttag(*place, **attributes))


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx.

    app : of Sphinx
    """
    app.set_translator("html", Translator)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
