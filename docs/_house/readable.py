"""HTML that keyboards and screen readers can follow, where Sphinx's own leaves something out.

Captions of tables of contents tell their level as headings, wide tables and long lines of code can be
scrolled by keys, and the parameters of a signature, one a line, do not pretend to be definitions.
"""

from __future__ import annotations

from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.writers.html5 import HTML5Translator

SIGNATURE = (
    addnodes.desc_parameterlist,
    addnodes.desc_parameter,
    addnodes.desc_optional,
    addnodes.desc_type_parameter_list,
    addnodes.desc_type_parameter,
)


class Translator(HTML5Translator):
    """Sphinx's own, with a few attributes more."""

    def starttag(self, node: Any, tagname: str, *more: Any, **attributes: Any) -> str:
        """An opening tag; node, tagname, more, attributes : as Sphinx gives them."""
        if attributes.get("ROLE") == "heading":
            attributes["ARIA-LEVEL"] = "2"
        if isinstance(node, nodes.container) and "table-wrapper" in node.get("classes", ()):
            attributes["TABINDEX"] = "0"
        if tagname in ("dl", "dd") and isinstance(node, SIGNATURE):
            attributes["ROLE"] = "none"
        return str(super().starttag(node, tagname, *more, **attributes))

    def visit_literal_block(self, node: nodes.literal_block) -> None:
        """A block of code; node : as Sphinx gives it."""
        begin = len(self.body)
        try:
            super().visit_literal_block(node)
        finally:  # it ends by raising SkipNode
            self.body[begin:] = [part.replace("<pre>", '<pre tabindex="0">') for part in self.body[begin:]]


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx.

    app : of Sphinx
    """
    app.set_translator("html", Translator)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
