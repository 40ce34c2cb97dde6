"""What the texts of a spec mean, by their paths: names that are declared, references, formulas.

In: a path, and whether it is that of a key or of a value. Out: its Role and its scope: the module, and the
definition, within which its names are looked up.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from typing import Final, Literal, TypeAlias

from neurovis_spec.lsp.outline import Path

#: What a name names. Groups, neurons, inputs and instances share their names; "local" is known in one definition.
Kind: TypeAlias = Literal[
    "parameter", "neuron", "input", "instance", "output", "module", "activation", "model", "rule", "local"
]
Use: TypeAlias = Literal[
    "declares",
    "names",
    "formula",
    "template",
    "ends",
    "references",
    "choice",
    "setting",
    "setting value",
    "state",
    "pattern",
    "engine",
    "message",
    "field",
]


@dataclass(frozen=True, slots=True)
class Role:
    """What a text is for. ``kind`` is what it declares or names; ``given`` are the names that a formula has here."""

    use: Use
    kind: Kind | None = None
    given: tuple[str, ...] = ()
    random: bool = False
    functions: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Scope:
    """Within which module (None: the spec itself) and which definition (section, name) a text stands."""

    module: str | None = None
    definition: tuple[str, str] | None = None


_FORMULA = Role("formula")
_GROUP = Role("formula", given=("i", "n"))
_GROUP_DRAWN = Role("formula", given=("i", "n"), random=True)
_NOISE = Role("formula", given=("i", "n", "k", "t"), random=True)
_PAIR = Role("formula", given=("i", "j", "n_from", "n_to", "distance"), random=True)
_RUN = Role("formula", given=("k", "t"))
_IN_ACTIVATION = Role("formula", given=("x",))
_IN_MODEL = Role("formula", given=("drive", "k", "t"))
_ACTIVITY = Role("formula", given=("drive", "k", "t"), functions=("f",))
_IN_RULE = Role("formula", given=("pre", "sent", "post", "weight", "k", "t"))

#: Keys. ``*`` is a name of the author's, ``#`` an index that may be there or not.
_KEYS: Final[Mapping[str, Role]] = {
    "parameters *": Role("declares", "parameter"),
    "inputs *": Role("declares", "input"),
    "neurons *": Role("declares", "neuron"),
    "instances *": Role("declares", "instance"),
    "modules *": Role("declares", "module"),
    "activations *": Role("declares", "activation"),
    "models *": Role("declares", "model"),
    "rules *": Role("declares", "rule"),
    "outputs *": Role("declares", "output"),
    "activations * parameters *": Role("declares", "local"),
    "activations * let *": Role("declares", "local"),
    "models * parameters *": Role("declares", "local"),
    "models * let *": Role("declares", "local"),
    "models * state *": Role("declares", "local"),
    "rules * parameters *": Role("declares", "local"),
    "rules * let *": Role("declares", "local"),
    "rules * state *": Role("declares", "local"),
    "connections # *": Role("ends"),
    "ros subscribe *": Role("names", "input"),
    "ros publish *": Role("names", "output"),
    "layout positions *": Role("references"),
    "layout arrange *": Role("references"),
    "events # set *": Role("names", "parameter"),
    "instances * set *": Role("names", "parameter"),
    "instances * inputs *": Role("names", "input"),
    "events # clamp *": Role("references"),
    "events # learning *": Role("ends"),
    "render gain activity *": Role("references"),
    "render trace *": Role("references"),
    "render gain signal *": Role("ends"),
    "render gain thickness *": Role("ends"),
    "render gain change *": Role("ends"),
    "neurons * activation *": Role("choice", "activation"),
    "neurons * model *": Role("choice", "model"),
    "connections # * plasticity *": Role("choice", "rule"),
    "connections # * pattern *": Role("pattern"),
    "neurons * activation * *": Role("setting", "activation"),
    "neurons * model * *": Role("setting", "model"),
    "neurons * initial *": Role("state", "model"),
    "connections # * plasticity * *": Role("setting", "rule"),
}
_VALUES: Final[Mapping[str, Role]] = {
    "time dt": _FORMULA,
    "time steps": _FORMULA,
    "time episode": _FORMULA,
    "parameters *": _FORMULA,
    "parameters * value": _FORMULA,
    "parameters * min": _FORMULA,
    "parameters * max": _FORMULA,
    "inputs * expression": _RUN,
    "inputs * size": _FORMULA,
    "inputs * values # #": _FORMULA,
    "neurons * count": _FORMULA,
    "neurons * first": _FORMULA,
    "neurons * names #": Role("declares", "neuron"),
    "neurons * bias #": _GROUP_DRAWN,
    "neurons * initial #": _GROUP_DRAWN,
    "neurons * initial * #": _GROUP_DRAWN,
    "neurons * noise": _NOISE,
    "neurons * label #": Role("template", given=("i", "n", "number")),
    "neurons * input": Role("names", "input"),
    "neurons * position # #": _GROUP,
    "neurons * activation": Role("choice", "activation"),
    "neurons * model": Role("choice", "model"),
    "neurons * activation * * #": _GROUP,
    "neurons * model * * #": _GROUP,
    "connections # *": _PAIR,
    "connections # * weight": _PAIR,
    "connections # * centre # #": _PAIR,
    "connections # * matrix # #": _PAIR,
    "connections # * delay": _FORMULA,
    "connections # * bounds #": _FORMULA,
    "connections # * scale spectral_radius": _FORMULA,
    "connections # * scale norm": _FORMULA,
    "connections # * pattern": Role("pattern"),
    "connections # * pattern * *": _FORMULA,
    "connections # * plasticity": Role("choice", "rule"),
    "connections # * plasticity * * #": Role("setting value", "rule", given=("i", "j", "n_from", "n_to")),
    "connections # * edges # #": Role("references"),
    "outputs * #": Role("references"),
    "layout boxes * #": Role("references"),
    "layout mirror # #": Role("references"),
    "layout align # #": Role("references"),
    "layout plan # #": Role("references"),
    "layout engine": Role("engine"),
    "layout positions * #": _FORMULA,
    "layout spacing *": _FORMULA,
    "render gain * #": _FORMULA,
    "render gain * * #": _FORMULA,
    "render figure # * #": Role("ends"),
    "render window": _FORMULA,
    "render trace *": _FORMULA,
    "render size #": _FORMULA,
    "ros rate": _FORMULA,
    "ros qos depth": _FORMULA,
    "ros subscribe * timeout": _FORMULA,
    "ros publish * safe": _FORMULA,
    "ros * * type": Role("message"),
    "ros * * field": Role("field"),
    "instances * module": Role("names", "module"),
    "instances * inputs *": Role("names", "input"),
    "instances * count": _FORMULA,
    "instances * set *": _GROUP,
    "events # at": _FORMULA,
    "events # from": _FORMULA,
    "events # to": _FORMULA,
    "events # set *": _FORMULA,
    "events # clamp *": _FORMULA,
    "events # lesion #": Role("ends"),
    "events # mend #": Role("ends"),
    "rules * signals #": Role("declares", "local"),
    "activations * let *": _IN_ACTIVATION,
    "activations * value": _IN_ACTIVATION,
    "models * let *": _IN_MODEL,
    "models * state * each_step": _IN_MODEL,
    "models * state * each_episode": _IN_MODEL,
    "models * activity": _ACTIVITY,
    "rules * let *": _IN_RULE,
    "rules * state * each_step": _IN_RULE,
    "rules * state * each_episode": _IN_RULE,
    "rules * weight each_step": _IN_RULE,
    "rules * weight each_episode": _IN_RULE,
    **{
        f"{kind} * parameters *{part}": _FORMULA
        for kind in ("activations", "models", "rules")
        for part in ("", " value", " min", " max")
    },
    **{f"{kind} * state * initial": _FORMULA for kind in ("models", "rules")},
}
#: The kinds that definitions declare, by section.
DEFINITIONS: Final[Mapping[str, Kind]] = {"activations": "activation", "models": "model", "rules": "rule"}
SECTIONS: Final[Mapping[Kind, str]] = {kind: section for section, kind in DEFINITIONS.items()}


def role_of(path: Path, is_key: bool) -> tuple[Role | None, Scope]:
    """The role and the scope of a key or a value.

    >>> role_of(("neurons", "K", "bias", 2), False)[0].given
    ('i', 'n')
    >>> role_of(("modules", "leg", "parameters", "gain"), True)[1].module
    'leg'
    """
    module = None
    if len(path) > 2 and path[0] == "modules" and isinstance(path[1], str):
        module, path = path[1], path[2:]
    role = _role(tuple(0 if isinstance(part, int) else part for part in path), is_key)
    if path[-3:-2] == ("edges",) and path[-1] in (2, 3):  # behind its two ends an edge has a weight and a delay
        role = _PAIR if path[-1] == 2 else _FORMULA
    definition = None
    if len(path) > 2 and path[0] in DEFINITIONS:
        definition = (str(path[0]), str(path[1]))
    return role, Scope(module, definition)


@lru_cache(maxsize=4096)
def _role(path: Path, is_key: bool) -> Role | None:
    """The role of a path whose indices are 0: those of long lists are one."""
    return next((role for pattern, role in _patterns(is_key) if _fits(pattern, path)), None)


@cache
def _patterns(is_key: bool) -> tuple[tuple[tuple[str, ...], Role], ...]:
    return tuple((tuple(pattern.split()), role) for pattern, role in (_KEYS if is_key else _VALUES).items())


def _fits(pattern: tuple[str, ...], path: Path) -> bool:
    if not pattern:
        return not path
    first, rest = pattern[0], pattern[1:]
    if first == "#":
        return (bool(path) and isinstance(path[0], int) and _fits(rest, path[1:])) or _fits(rest, path)
    if not path or isinstance(path[0], int):
        return False
    return (first == "*" or first == path[0]) and _fits(rest, path[1:])
