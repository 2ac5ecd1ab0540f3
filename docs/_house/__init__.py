"""Extensions of the documentation site: pages of the API, and docstrings in the style of this house."""
