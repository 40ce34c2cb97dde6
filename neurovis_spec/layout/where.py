"""Where the spec says what a layout engine refuses, or what makes frames lie on each other.

In: a LayoutRefusalError or clashes, the spec and the network that it became. Out: the place of the pin, the line, the
mirror, the arrangement or the group that the refusal is about, None where the spec says nothing of the kind; warnings.
It is looked for when there is something to say, so that no network has to know where it was written.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Final, NamedTuple

from neurovis_spec.compiler.compile import Request
from neurovis_spec.compiler.names.modules import library_of
from neurovis_spec.compiler.names.references import Section, key_of, key_span
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.references import NeuronRange, parse_sum
from neurovis_spec.language.spec import Spec
from neurovis_spec.layout.clashes import Clash
from neurovis_spec.layout.model import LayoutRefusalError

#: What a refusal may be about: parts of ``layout`` (and ``neurons``), the likeliest first.
_PARTS: Final[Mapping[str, Sequence[str]]] = {
    "position-missing": ("neurons", "engine"),
    "arranged-twice": ("arrange",),
    "align-conflict": ("align",),
    "align-pins": ("positions", "align"),
    "mirror-pins": ("positions", "mirror"),
    "mirror-frames": ("mirror",),
    "mirror-arrange": ("arrange", "mirror"),
    "pin-in-frame": ("positions", "mirror", "align", "plan"),
    "frames-overlap": ("positions", "file", "boxes", "instances", "neurons"),
    "pins-too-close": ("positions",),
    "pin-not-finite": ("positions",),
    "layout-pins-unsupported": ("positions",),
    "layout-arrange-unsupported": ("arrange",),
    "layout-boxes-unsupported": ("boxes",),
    "layout-mirror-unsupported": ("mirror",),
    "layout-align-unsupported": ("align",),
    "layout-plan-unsupported": ("plan",),
    "plan-mirror": ("plan",),
    "layout-memory-unsupported": ("file",),
    "layout-direction-unsupported": ("direction",),
}
#: These speak of all of a part, not of neurons.
_WHOLE: Final = "-unsupported"
_APART: Final = "move one of them, where a pin or the layout file says where it is, or let it go"
_TOGETHER: Final = (
    "let a box hold what stands together: whole instances, both sides of a mirror, one cell of a plan; or leave it out"
)
_NUMBER: Final = re.compile(r"(?P<stem>.*\D)(?P<number>\d+)", re.ASCII)


class _Entry(NamedTuple):
    """Something that the spec says, where, and the references in it."""

    span: Span
    texts: tuple[str, ...]


class _Sections:
    """The spec, and the modules of a network's instances by their paths."""

    def __init__(self, spec: Spec, request: Request, network: Network) -> None:
        self._spec = spec
        self._modules: Mapping[str, Section] = {}
        self._paths = {instance.path: instance.module for instance in network.instances}
        if self._paths:
            library = library_of(spec, request.includes, request.base, network.dt, Findings())
            self._modules = {name: module.model for name, module in library.modules.known().items()}

    def around(self, name: str) -> Iterator[tuple[Section, str]]:
        """The sections that may speak of a neuron, outer ones first, and how each calls it."""
        yield self._spec, name
        steps = name.split(".")
        for depth in range(1, len(steps)):
            section = self._modules.get(self._paths.get(".".join(steps[:depth]), ""))
            if section is not None:
                yield section, ".".join(steps[depth:])

    def all(self) -> Iterator[Section]:
        """The spec, then every module in use."""
        yield self._spec
        for module in dict.fromkeys(self._paths.values()):
            if module in self._modules:
                yield self._modules[module]


def where(
    refusal: LayoutRefusalError, spec: Spec, request: Request, network: Network, chosen: str | None = None
) -> Span | None:
    """The place in the spec that a refusal is about. ``chosen`` is the engine, where it was not the spec's choice."""
    return _place(refusal.code, refusal.about, spec, _Sections(spec, request, network), chosen)


def note_clashes(found: Iterable[Clash], spec: Spec, request: Request, network: Network, findings: Findings) -> None:
    """Note warnings (``frames-overlap``) where the spec makes frames lie on each other."""
    sections = _Sections(spec, request, network)
    pinned = any(True for section in sections.all() for _ in _entries(section, "positions"))
    remembered = spec.layout is not None and spec.layout.file is not None
    hint = _APART if pinned or remembered else _TOGETHER
    for clash in found:
        span = _place("frames-overlap", clash.about, spec, sections, None)
        findings.warning("frames-overlap", span or Span(*spec.name.span), clash.message, hint)


def _place(code: str, about: Sequence[str], spec: Spec, sections: _Sections, chosen: str | None) -> Span | None:
    for part in _PARTS.get(code, ("engine",)):
        if part in ("engine", "file", "direction"):
            written = None if spec.layout is None else getattr(spec.layout, part)
            if written is not None and (part != "engine" or chosen is None):
                return Span(*written.span)
            continue
        if code.endswith(_WHOLE):
            said = (entry.span for section in sections.all() for entry in _entries(section, part))
            found = next(said, None)
        else:
            found = _about(about, sections, part) or _beside(about, sections, part)
        if found is not None:
            return found
    return None


def _about(about: Sequence[str], sections: _Sections, part: str) -> Span | None:
    """What names one of these neurons; of several entries the most exact one."""
    for name in about:
        for section, own in sections.around(name):
            found = [
                (text.count("."), len(text), entry.span)
                for entry in _entries(section, part)
                for text in entry.texts
                if _names(text, own)
            ]
            if found:
                return max(found)[2]
    return None


def _beside(about: Sequence[str], sections: _Sections, part: str) -> Span | None:
    """What names a neuron in the same outermost instance: it holds the whole of it."""
    if part != "positions":
        return None
    for name in about:
        outermost, dot, _ = name.partition(".")
        for section, _ in sections.around(name) if dot else ():
            for entry in _entries(section, part):
                if any(_names(text.partition(".")[0], outermost) for text in entry.texts):
                    return entry.span
    return None


def _entries(section: Section, part: str) -> Iterator[_Entry]:
    """What a section says in one of its parts."""
    if part in ("neurons", "instances"):
        for name in section.neurons if part == "neurons" else section.instances:
            yield _Entry(key_span(section, part, name), (name,))
    layout = section.layout
    if layout is None:
        return
    if part == "positions":
        for name, point in layout.positions.items():
            yield _Entry(point.span, (name,))
    elif part == "arrange":
        for name in layout.arrange:
            yield _Entry(key_of(layout.source, part, name).span, (name,))
    elif part in ("mirror", "align"):
        for reference in layout.mirror if part == "mirror" else layout.align:
            yield _Entry(reference.span, tuple(text.value for text in reference.parts))
    elif part == "plan":
        for row in layout.plan:
            yield _Entry(row.span, tuple(cell.value for cell in row.cells if cell is not None))
    elif part == "boxes":
        for reference in layout.boxes.values():
            yield _Entry(reference.span, tuple(text.value for text in reference.parts))


def _names(text: str, name: str) -> bool:
    """Whether a reference means a neuron: by its name, its group, a range, or an instance around it.

    >>> _names("left", "left2.K1"), _names("left.K", "left2.K1"), _names("K1..K3", "K2"), _names("K1", "K12")
    (True, True, True, False)
    """
    steps = name.split(".")
    for part in parse_sum(text):
        if isinstance(part, NeuronRange):
            numbered, own = part.numbers, _NUMBER.fullmatch(steps[-1])
            if numbered is not None and own is not None and int(own["number"]) in numbered[1]:
                group = numbered[0].split(".")
                if group[-1] == own["stem"] and len(group) == len(steps) and _lead(group[:-1], steps[:-1]):
                    return True
        elif _lead(part.text.split("."), steps):
            return True
    return False


def _lead(written: Sequence[str], steps: Sequence[str]) -> bool:
    """Whether the instances, the group or the neuron of a reference are, or hold, these: ``left`` is ``left2``, too."""
    return len(written) <= len(steps) and all(
        step == own or (not step[-1:].isdigit() and step == own.rstrip("0123456789"))
        for step, own in zip(written, steps, strict=False)
    )
