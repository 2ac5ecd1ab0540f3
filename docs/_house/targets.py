"""Names in signatures lead to the class that their module means, also where two packages share a name."""

from __future__ import annotations

import sys
from typing import Any

from docutils import nodes
from sphinx import addnodes


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx.

    app : of Sphinx
    """
    app.connect("doctree-read", lambda app, document: qualify(document))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def qualify(document: nodes.document) -> None:
    """Give references to a bare name the full name of what the module has under it.

    document : a page, as read
    """
    for reference in document.findall(addnodes.pending_xref):
        name, module = reference.get("reftarget", ""), reference.get("py:module")
        if reference.get("refdomain") == "py" and module and "." not in name:
            meant = getattr(sys.modules.get(module), name, None)
            if isinstance(meant, type) and meant.__module__.startswith("tubefoot"):
                reference["reftarget"] = f"{meant.__module__}.{meant.__qualname__}"
