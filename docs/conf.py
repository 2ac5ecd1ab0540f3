"""Settings of the documentation site (Sphinx, MyST Markdown, Furo); `make docs` builds it without network."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from tubefoot import __version__

project = "Tubefoot"
author = "The Tubefoot authors"
project_copyright = "The Tubefoot authors"
version = release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc"]
extensions += ["_house.api", "_house.readable", "_house.docstrings", "_house.targets"]
exclude_patterns = ["_house", "README.md"]

myst_enable_extensions = ["smartquotes"]
myst_heading_anchors = 4

autodoc_default_options = {"members": True, "undoc-members": False, "member-order": "bysource"}
autodoc_typehints = "signature"
# Full names find their target; readers see the short ones.
autodoc_typehints_format = "fully-qualified"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 100
add_module_names = False

html_theme = "furo"
html_title = f"Tubefoot {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_theme_options = {"top_of_page_buttons": []}
html_copy_source = False
html_show_sphinx = False
html_favicon = None
# Code in the site is often a shell line or a table of numbers, not Python.
highlight_language = "none"
pygments_style = "a11y-high-contrast-light"
pygments_dark_style = "a11y-high-contrast-dark"
