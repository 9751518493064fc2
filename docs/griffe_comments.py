"""An extension of griffe: the comment behind a field is its docstring, as the package writes its units and shapes."""

import re
from typing import Any

import griffe

COMMENT = re.compile(r"\s#:? (?!type:|noqa|fmt:)(?P<words>.+)$")


class FieldComments(griffe.Extension):
    """Fields without a docstring have the comment of their line."""

    def on_attribute_instance(self, *, attr: griffe.Attribute, **kwargs: Any) -> None:
        """Take the comment, where there is one."""
        comment = COMMENT.search(attr.lines[-1]) if attr.docstring is None and attr.lines else None
        if comment:
            words = comment["words"]
            attr.docstring = griffe.Docstring(words[0].upper() + words[1:], parent=attr)
