"""Leaves of a spec: values that know where they stand, and how they are checked.

In: nodes of a SourceDocument. Out: Located values (text, number, truth value, formula), or a finding at the node. The
checks are pydantic validators: they report into the Findings that the caller passes as ``context``, and then give up
on that value with the error ``reported``, so that all other values are still checked.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Generic, NamedTuple, NoReturn, TypeAlias, TypeVar, get_args

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import PydanticCustomError, core_schema

from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language import grammar
from neurovis_spec.language.expressions.habits import ungrouped_hint, unit_hint, unit_of
from neurovis_spec.language.expressions.lexer import decimal_hint
from neurovis_spec.language.grammar import FORMULA, REFERENCE, TEXT, TEXTS, Either, ListOf, Plain, Shape
from neurovis_spec.language.units import Measured, UnitError, measured, number_in, seconds_of
from neurovis_spec.language.unknown import UNKNOWN, Unknown
from neurovis_spec.language.yaml.scalars import INTEGER_HIGH, INTEGER_LOW
from neurovis_spec.language.yaml.source import AnyList, Node, Scalar, describe, one_or_more
from neurovis_spec.likeness import did_you_mean, in_ascii, meant, nearest, suggest

T = TypeVar("T")
M = TypeVar("M")
V = TypeVar("V")
N = TypeVar("N", bound=Node)
Default = TypeVar("Default")

#: The error by which a validator says that the finding is already noted.
REPORTED = "reported"

#: Findings of one list, after which the rest of it is not checked.
_PATIENCE = 20

IDENTIFIER = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
NAME = Plain({"type": "string", "pattern": f"^{IDENTIFIER.pattern}$"})


@dataclass(frozen=True, slots=True, eq=False)
class Leaf(Generic[N]):
    """The annotation of a field whose value our own ``check`` makes from a node; ``shape`` is what may be written."""

    check: Callable[[N, ValidationInfo], object]
    shape: Shape
    #: whether the value may be UNKNOWN, where it has to be there
    may_be_unknown: bool = False

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        """The check alone: pydantic need not know the classes of our values."""
        return core_schema.with_info_plain_validator_function(self._checked)

    def _checked(self, node: N | Located[Unknown], info: ValidationInfo) -> object:
        return node if isinstance(node, Located) else self.check(node, info)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """The JSON Schema of the value as written."""
        return grammar.schema_of(self.shape)


class Located(NamedTuple, Generic[T]):
    """A value and its place; ``node`` is the scalar it came from."""

    value: T
    node: Scalar

    @property
    def span(self) -> Span:
        """Where the whole value stands."""
        return self.node.span


def value_or(written: Located[T] | None, otherwise: Default) -> T | Default:
    """The value that is written, or another one where none is."""
    return otherwise if written is None else written.value


def unknown_at(span: Span) -> Located[Unknown]:
    """What stands in the place of a value that is missing or invalid, which is reported."""
    return Located(UNKNOWN, Scalar(None, span))


#: A number or an expression, as written.
Formula: TypeAlias = Located[int | float | str | Unknown]


def findings_of(info: ValidationInfo) -> Findings:
    """The Findings that the caller of the validation passed along."""
    assert isinstance(info.context, Findings)
    return info.context


def give_up() -> NoReturn:
    """Leave this value; the finding is reported."""
    raise PydanticCustomError(REPORTED, "reported")


def refuse(
    info: ValidationInfo, node: Node, wanted: str, hint: str | None = None, code: str = "wrong-type"
) -> NoReturn:
    """Report that something else was wanted here, and leave this value."""
    findings_of(info).error(code, node.span, f"expected {wanted}, found {describe(node)}", hint)
    give_up()


def items_of(node: Node, info: ValidationInfo, wanted: str, hint: str | None = None) -> tuple[Node, ...]:
    """The items of a list; anything else is refused."""
    return node.items if isinstance(node, AnyList) else refuse(info, node, wanted, hint)


def as_text(node: Node, info: ValidationInfo) -> Located[str]:
    """A text; numbers and truth values are answered with a hint to quote them."""
    if isinstance(node, Scalar) and isinstance(node.value, str):
        return Located(node.value, node)
    hint = "put it in quotes" if isinstance(node, Scalar) else None
    if hint and isinstance(node, Scalar) and node.value is None:
        written = node.span.end_column > node.span.column
        hint = "YAML reads this as null: put it in quotes, or take another name" if written else None
    elif hint and isinstance(node, Scalar) and isinstance(node.value, bool):
        hint = "YAML reads this as true or false: put it in quotes"
    refuse(info, node, "a text", hint)


def as_identifier(node: Node, info: ValidationInfo) -> Located[str]:
    """A name: an ASCII letter or underscore, then letters, digits, underscores, at most 64."""
    if isinstance(node, Scalar) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
        refuse(info, node, "a name", NAME_RULE)
    text = as_text(node, info)
    if not IDENTIFIER.fullmatch(text.value):
        findings_of(info).error("bad-name", node.span, bad_name(text.value), name_hint(text.value))
        give_up()
    return text


_PARTING = re.compile(r"(?<=\w)[ -]+(?=\w)")
NAME_RULE = "a name is a letter or underscore, then letters, digits and underscores, 64 at most"


def name_hint(name: str) -> str:
    """The help line for a name that is none: what it looks like, where that is a name, else the rule.

    >>> name_hint("left-leg"), name_hint("2nd")[:16]
    ("did you mean 'left_leg'?", 'a name is a lett')
    """
    if "->" in name:
        return "a connection stands under 'connections'"
    seen = in_ascii(name)
    if seen == name:  # with blanks or signs within it
        seen = _PARTING.sub("_", name)
    return did_you_mean([seen]) if seen != name and IDENTIFIER.fullmatch(seen) else NAME_RULE


def too_long(name: str) -> str:
    """The sentence for a name that a count makes too long."""
    return f"the count makes '{shorten(name)}' of {len(name)} characters"


def bad_name(name: str) -> str:
    """The sentence for a name that is none."""
    return f"'{shorten(name)}' is not a name"


def as_bool(node: Node, info: ValidationInfo) -> Located[bool]:
    """true or false; what other YAML versions read as such is answered with the right word."""
    if isinstance(node, Scalar) and isinstance(node.value, bool):
        return Located(node.value, node)
    hint = None
    if isinstance(node, Scalar) and isinstance(node.value, str):
        word = node.value.casefold()
        hint = {"yes": "write true", "on": "write true", "no": "write false", "off": "write false"}.get(word)
    refuse(info, node, "true or false", hint)


def formula_of(node: Node, findings: Findings, hint: str | None = None) -> Formula | Unknown:
    """A finite number, or the text of an expression; UNKNOWN where it is neither (that is reported, with the hint)."""
    if isinstance(node, Scalar):
        value = node.value
        if isinstance(value, str) and value.strip():
            return Located(value, node)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            if math.isfinite(value):
                return Located(value, node)
            bound = "a spec has finite numbers alone; a bound that there is not is left out"
            findings.error("not-finite", node.span, "a finite number is wanted here", bound)
            return UNKNOWN
    message = f"expected a number or an expression, found {describe(node)}"
    findings.error("wrong-type", node.span, message, hint)
    return UNKNOWN


def _refuse_unit(formula: Formula, info: ValidationInfo) -> None:
    """Refuse a number with a unit, where the key says whether a time is wanted, and in what."""
    unit = unit_of(formula.value) if isinstance(formula.value, str) else None
    hint = None if unit is None or info.field_name is None else unit_hint(*unit, info.field_name.rstrip("_"))
    if hint is not None:
        message = f"'{shorten(str(formula.value).strip())}' is no number: it has a unit"
        findings_of(info).error("malformed-number", formula.node.span, message, hint)
        give_up()


def as_formula(node: Node, info: ValidationInfo) -> Formula:
    """A finite number, or the text of an expression."""
    rows = info.field_name == "weight" and isinstance(node, AnyList)
    formula = formula_of(node, findings_of(info), "rows of weights stand under 'matrix'" if rows else None)
    if formula is UNKNOWN:
        give_up()
    _refuse_unit(formula, info)
    return formula


def _with_unit(value: object) -> Measured | None:
    """What is written as a number with a unit; None where it is something else."""
    return measured(value) if isinstance(value, str) else None


def _converted(convert: Callable[[Measured], float], written: Measured, node: Scalar, findings: Findings) -> Formula:
    """A number with a unit, converted; UNKNOWN where its unit does not fit, which is reported."""
    try:
        return Located(convert(written), node)
    except UnitError as error:
        findings.error("bad-unit", node.span, str(error), error.hint)
        return Located(UNKNOWN, node)


def time_of(node: Node, findings: Findings) -> Formula | Unknown:
    """A time with its unit, as Seconds, or what ``formula_of`` takes; UNKNOWN where it is neither."""
    if isinstance(node, Scalar) and (written := _with_unit(node.value)) is not None:
        return _converted(seconds_of, written, node, findings)
    return formula_of(node, findings)


def as_time(node: Node, info: ValidationInfo) -> Formula:
    """A time with its unit (``1.5 ms``), or a finite number, or the text of an expression."""
    if isinstance(node, Scalar) and (written := _with_unit(node.value)) is not None:
        formula = _converted(seconds_of, written, node, findings_of(info))
        return give_up() if formula.value is UNKNOWN else formula
    return as_formula(node, info)


def as_measured(node: Node, info: ValidationInfo) -> Formula:
    """A finite number, which may have a unit, or the text of an expression."""
    if isinstance(node, Scalar) and isinstance(node.value, str) and _with_unit(node.value) is not None:
        return Located(node.value, node)
    return as_formula(node, info)


def in_unit(formula: Formula, unit: str, findings: Findings) -> Formula:
    """The same; where it is a number with a unit, that number in this unit. Without one it stays as it is, which is no
    expression."""
    written = _with_unit(formula.value) if unit else None
    if written is None:
        return formula
    return _converted(partial(number_in, unit), written, formula.node, findings)


def as_number(node: Node, info: ValidationInfo) -> Located[float]:
    """A finite number as such, no expression."""
    if not isinstance(node, Scalar) or isinstance(node.value, (str, bool)) or node.value is None:
        text = node.value if isinstance(node, Scalar) else None
        if isinstance(text, str) and (apart := ungrouped_hint(text)):
            message = f"'{shorten(text)}' is no number: nothing stands between thousands"
            findings_of(info).error("malformed-number", node.span, message, apart)
            give_up()
        refuse(info, node, "a number", decimal_hint(text) if isinstance(text, str) else None)
    formula = as_formula(node, info)
    assert formula.value is not UNKNOWN
    return Located(float(formula.value), formula.node)


def as_integer(node: Node, info: ValidationInfo) -> Located[int]:
    """An integer as such (2.0 counts), no expression."""
    number = as_number(node, info)
    if number.value != int(number.value):
        refuse(info, node, "an integer")
    whole = number.node.value
    result = whole if isinstance(whole, int) else int(number.value)
    if not INTEGER_LOW <= result <= INTEGER_HIGH:
        findings_of(info).error("integer-range", node.span, f"the integer {number.value:g} is beyond signed 64 bits")
        give_up()
    return Located(result, number.node)


def valid(items: Iterable[M], read: Callable[[M, ValidationInfo], V], info: ValidationInfo) -> Iterator[V]:
    """What is read of some items, without those that are invalid, which are reported."""
    before = findings_of(info).errors
    for item in items:
        with suppress(PydanticCustomError):
            yield read(item, info)
        if findings_of(info).errors - before >= _PATIENCE:
            return


def each(items: Collection[M], read: Callable[[M, ValidationInfo], V], info: ValidationInfo) -> tuple[V, ...]:
    """What is read of some items, all of which must be valid; each that is not is reported."""
    result = tuple(valid(items, read, info))
    return result if len(result) == len(items) else give_up()


def as_texts(node: Node, info: ValidationInfo) -> tuple[Located[str], ...]:
    """A text or a list of texts; each that is none is reported."""
    return each(one_or_more(node), as_text, info)


def as_parts(node: Node, info: ValidationInfo) -> tuple[Located[str], ...]:
    """The same, without the items that are no texts: an invalid one does not make the others invalid."""
    return tuple(valid(node.items, as_text, info)) if isinstance(node, AnyList) else (as_text(node, info),)


def one_of(*words: str) -> Callable[[Node, ValidationInfo], Located[str]]:
    """A validator for a choice between words; a misspelling is answered with the nearest ones."""

    def check(node: Node, info: ValidationInfo) -> Located[str]:
        text = as_text(node, info)
        if text.value not in words:
            message = f"'{shorten(text.value)}' is not one of {', '.join(words)}"
            hint = suggest(text.value, words) if nearest(text.value, words) else None
            findings_of(info).error("unknown-value", node.span, message, hint)
            right = meant(text.value, words)
            if right is None:
                give_up()
            return Located(right, text.node)
        return text

    return check


def words(*allowed: object, abouts: Mapping[str, str] | None = None) -> Leaf[Node]:
    """The annotation of a field that takes one of these words, or those of a Literal; ``abouts`` says what they
    mean."""
    known = [str(word) for one in allowed for word in (get_args(one) or (one,))]
    return Leaf(one_of(*known), grammar.words(*known, abouts=abouts))


TextField = Annotated[Located[str], Leaf(as_text, TEXT)]
TextsField = Annotated[tuple[Located[str], ...], Leaf(as_texts, TEXTS)]
#: A reference, or a list of them: each stands for itself.
PartsField = Annotated[tuple[Located[str], ...], Leaf(as_parts, Either((REFERENCE, ListOf(REFERENCE))))]
IdentifierField = Annotated[Located[str], Leaf(as_identifier, NAME)]
NamesField = Annotated[tuple[Located[str], ...], Leaf(as_texts, Either((NAME, ListOf(NAME))))]
BoolField = Annotated[Located[bool], Leaf(as_bool, Plain({"type": "boolean"}))]
IntegerField = Annotated[
    Located[int], Leaf(as_integer, Plain({"type": "integer", "minimum": INTEGER_LOW, "maximum": INTEGER_HIGH}))
]
FormulaField = Annotated[Formula, Leaf(as_formula, FORMULA, True)]
#: The same, or a number with a unit, of what may have one.
MeasuredField = Annotated[Formula, Leaf(as_measured, FORMULA, True)]
#: The same, or a time with its unit.
TimeField = Annotated[Formula, Leaf(as_time, FORMULA, True)]
