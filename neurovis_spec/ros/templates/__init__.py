"""The files of packages for ROS, as templates, and how they are filled: every value is escaped for its place.

In: the name of a template, values. Out: a text. Nothing is inserted without a filter but names that the language or we
have checked, and numbers.
"""

from __future__ import annotations

import json
import math
from functools import cache
from typing import TYPE_CHECKING
from xml.sax.saxutils import escape

from neurovis_spec.runtime.c_names import string

if TYPE_CHECKING:
    from jinja2 import Environment


def plain_line(text: str) -> str:
    """A text as one line that cannot end a comment.

    >>> plain_line("a\\nb\\tc -- d")
    'a b c -- d'
    """
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def xml(text: str) -> str:
    """A text in XML, between tags or quotes.

    >>> xml('a<b & "c"\\0')
    'a&lt;b &amp; &quot;c&quot; '
    """
    lawful = "".join(c if c in "\t\n" or c.isprintable() else " " for c in text)
    return escape(lawful, {chr(34): "&quot;", chr(39): "&apos;"})


def number(value: float) -> str:
    """A number that every reader of YAML takes for one.

    >>> number(2), number(1e-05), number(1e300)
    ('2.0', '1.0e-05', '1.0e+300')
    """
    if not math.isfinite(value):
        raise ValueError(f"{value} is not finite")
    text = repr(float(value))
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa if '.' in mantissa else f'{mantissa}.0'}{e}{exponent}"


@cache
def _environment() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    made = Environment(
        loader=PackageLoader("neurovis_spec.ros", "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    filters = {"xml": xml, "python": ascii, "yaml": json.dumps, "cpp": string, "line": plain_line, "number": number}
    made.filters |= filters
    return made


def render(template: str, values: dict[str, object]) -> str:
    """A file. Raises jinja2.UndefinedError for a value that a template needs and is not given."""
    return _environment().get_template(f"{template}.j2").render(values)
