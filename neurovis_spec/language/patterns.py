"""The patterns of connections: their names, what they connect, and the settings that each of them needs.

In: nothing. Out: a table. Which pairs a pattern makes is for the compiler.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Final

from neurovis_spec.language.grammar import (
    BOOL,
    FORMULA,
    OF_ENTRY,
    OF_SOURCE,
    OF_TARGET,
    PLAIN,
    WHICH,
    Either,
    Key,
    Map,
    Plain,
    Role,
    Shape,
    words,
)
from neurovis_spec.language.located import Leaf
from neurovis_spec.language.values import Choice, as_choice


@dataclass(frozen=True, slots=True)
class Setting:
    """A setting of a pattern, with a usual value: an integer from ``least`` on, or, without one, a probability; its
    formula has a ``role``. A ``flag`` is true or false, and may be left out."""

    usual: float
    about: str
    least: int | None = None
    role: Role = PLAIN
    flag: bool = False


@dataclass(frozen=True, slots=True)
class Pattern:
    """Which pairs of neurons a pattern connects. All of its settings have to be there, but for flags."""

    name: str
    about: str
    settings: Mapping[str, Setting] = field(default_factory=dict)

    @property
    def needed(self) -> Mapping[str, Setting]:
        """The settings that have to be there."""
        return {name: setting for name, setting in self.settings.items() if not setting.flag}

    @property
    def counts(self) -> bool:
        """Whether it makes so many connections as it is told, none of which can be left out."""
        return not {"count", "degree"}.isdisjoint(self.settings)

    @property
    def use(self) -> str:
        """How it is written, as an example."""
        settings = ", ".join(f"{name}: {setting.usual:g}" for name, setting in self.needed.items())
        return f"{{{self.name}: {{{settings}}}}}" if settings else self.name


#: Whether a pair may be connected several times.
_MULTAPSES: Final = Setting(0, "Whether a pair may be drawn several times (default false).", flag=True)


def _count(of: str, role: Role) -> dict[str, Setting]:
    return {
        "count": Setting(3, f"How many {of}; may be an expression, which may draw.", 0, role),
        "multapses": _MULTAPSES,
    }


PATTERNS: Final[Mapping[str, Pattern]] = {
    pattern.name: pattern
    for pattern in (
        Pattern("all_to_all", "Every source with every target."),
        Pattern("one_to_one", "The first with the first, the second with the second, …; equal sizes."),
        Pattern("chain", "i with i + 1; equal sizes, or one group."),
        Pattern("ring", "As chain, and the last with the first."),
        Pattern(
            "random",
            "Every pair with this probability, drawn from the seed.",
            {
                "probability": Setting(
                    0.1,
                    "The probability of each pair, from 0 to 1; may be an expression of distance, i, j, ….",
                    role=WHICH,
                )
            },
        ),
        Pattern(
            "fixed_indegree",
            "Every target with so many sources, drawn from the seed.",
            _count("sources each target has", OF_TARGET),
        ),
        Pattern(
            "fixed_outdegree",
            "Every source with so many targets, drawn from the seed.",
            _count("targets each source has", OF_SOURCE),
        ),
        Pattern("total", "So many pairs of all, drawn from the seed.", _count("connections there are", OF_ENTRY)),
        Pattern(
            "nearest",
            "Every source with its nearest targets, by position, or by index where no neuron has a position.",
            {"count": _count("targets each source has", OF_SOURCE)["count"]},
        ),
        Pattern(
            "small_world",
            "A ring whose neurons reach as many neighbours as the degree says, each of these connections led elsewhere "
            "with the probability rewire; equal sizes (Watts and Strogatz 1998).",
            {
                "degree": Setting(
                    4, "How many neighbours on the ring each neuron is connected with; an even number.", least=2
                ),
                "rewire": Setting(0.1, "The probability with which a connection is led elsewhere, from 0 to 1."),
            },
        ),
        Pattern(
            "band",
            "All pairs with |i − j| up to the width.",
            {"width": Setting(1, "The largest difference |i − j| of two neurons that are connected.", 0)},
        ),
    )
}


def _shape(setting: Setting) -> Shape:
    return BOOL if setting.flag else Plain(FORMULA.written, setting.role, formula=True)


def _body(pattern: Pattern) -> Key:
    settings = {name: Key(_shape(one), one.about, required=not one.flag) for name, one in pattern.settings.items()}
    return Key(Map(settings, nothing=not settings), pattern.about)


_SHAPE: Final = Either(
    (
        words(*(name for name, pattern in PATTERNS.items() if not pattern.settings)),
        Map({name: _body(pattern) for name, pattern in PATTERNS.items()}, one=True),
    )
)
PatternField = Annotated[Choice, Leaf(as_choice, _SHAPE), Role("pattern")]
