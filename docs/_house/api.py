"""One page of the API for each package of Tubefoot, written before Sphinx reads its sources."""

from __future__ import annotations

import ast
import importlib
from pathlib import Path
from typing import Any

SOURCES = Path(__file__).parents[2] / "src" / "tubefoot"
ORDER = "design fea reduced study lab vision control twin validation report dashboard"
LEFT_OUT = ("cli", "vendored")
"""The command line describes itself by `--help`."""


def setup(app: Any) -> dict[str, bool]:
    """Register with Sphinx.

    app : of Sphinx
    """
    # Autodoc imports with typing.TYPE_CHECKING set, which FastAPI's own imports do not survive.
    importlib.import_module("fastapi")
    app.connect("builder-inited", lambda app: write_pages(Path(app.srcdir) / "api"))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def write_pages(directory: Path) -> list[Path]:
    """The pages, after writing them; a page that is the same as before is not touched.

    directory : `docs/api`, which git does not keep
    """
    directory.mkdir(exist_ok=True)
    packages = [
        path for path in SOURCES.iterdir() if (path / "__init__.py").exists() and path.name not in LEFT_OUT
    ]
    known = {name: place for place, name in enumerate(ORDER.split())}
    packages.sort(key=lambda path: (known.get(path.name, len(ORDER)), path.name))
    pages = {"tubefoot": page("tubefoot", SOURCES / "__init__.py", _modules(SOURCES))}
    for package in packages:
        name = f"tubefoot.{package.name}"
        pages[name] = page(name, package / "__init__.py", _modules(package))
    pages["index"] = index(list(pages))
    for old in set(directory.glob("*.rst")) - {directory / f"{name}.rst" for name in pages}:
        old.unlink()
    return [_written(directory / f"{name}.rst", text) for name, text in pages.items()]


def page(name: str, init: Path, modules: list[Path]) -> str:
    """The text of a package's page in reStructuredText.

    name : of the package; init : its `__init__.py`; modules : files of its public modules
    """
    about = _docstring(init)
    lines = [name, "=" * len(name), "", about, ""]
    for module in modules:
        full = f"{name}.{module.stem}"
        title = f"``{full}``"
        lines += [title, "-" * len(title), "", f".. automodule:: {full}", ""]
    return "\n".join(lines)


def index(names: list[str]) -> str:
    """The page that leads to the packages.

    names : of the pages, in their order
    """
    title = "API"
    about = (
        "One page for each package, in the order of the pipeline. Inside, quantities are in mm, N, s, MPa, "
        "rad; where a name bears a unit, in that."
    )
    entries = [f"   {name}" for name in names]
    return "\n".join(
        [title, "=" * len(title), "", about, "", ".. toctree::", "   :maxdepth: 2", "", *entries, ""]
    )


def _modules(folder: Path) -> list[Path]:
    return [path for path in sorted(folder.glob("*.py")) if not path.stem.startswith("_")]


def _docstring(path: Path) -> str:
    text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    return text.replace("`", "``").replace("````", "``")


def _written(path: Path, text: str) -> Path:
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")
    return path
