"""Saved views: where a page stood, by a name, in a file beside the spec, ``SPEC.neurovis-view.yaml``.

In: the file, and a network. Out: SavedViews by their names, and findings with their places: of what is wrong a view has
nothing, and of what the network does not have any more it is said. A view is put into the file as an author would:
comments stay, and other views are not touched.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal, cast, get_args

from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Findings, Span
from neurovis_spec.language.format.edit import Path as Keys
from neurovis_spec.language.format.edit import Value, put, recalled, without
from neurovis_spec.language.yaml.opening import FileFault, read_bytes
from neurovis_spec.language.yaml.reader import LARGEST, read_content
from neurovis_spec.language.yaml.source import AnyList, Node, Scalar, describe
from neurovis_spec.language.yaml.source import Mapping as Entries
from neurovis_spec.layout.file import name_text, number_text
from neurovis_spec.likeness import suggest
from neurovis_spec.live.beside import Beside
from neurovis_spec.live.clock import SPEEDS
from neurovis_spec.live.curves import series_of
from neurovis_spec.live.typed import LONGEST
from neurovis_spec.live.typed import findings as measured
from neurovis_spec.live.windows import Window
from neurovis_spec.runtime.files import replacing
from neurovis_spec.themes import THEMES

VERSION: Final = 1
#: The largest step, and the most that a view may have of curves and of closed boxes.
FARTHEST: Final = (1 << 53) - 1
MOST: Final = 1024
_NEW: Final = f"neurovis_view: {VERSION}\n"
_KEYS: Final = ("neurovis_view", "views")
_OF_VIEW: Final = ("step", "speed", "camera", "curves", "theme", "closed", "shows", "window")
#: What a page can show: views of the network, as ``render`` calls them.
SHOWN: Final = ("network", "matrix", "pathways")
#: A line that is neither blank nor a comment.
_SAID: Final = re.compile(rb"(?:\xef\xbb\xbf)?\s*[^\s#]")
#: What joins the signals of one curve: behind the first, in the same axis, in a plane.
_JOINING: Final = re.compile(r" (?:over|with|against) ")


@dataclass(frozen=True, slots=True)
class SavedView:
    """Where a page stood: its ``step``, its ``speed`` (a key of ``SPEEDS``), its ``camera`` (how many times as large as
    the whole picture fits into the window; the units of the layout in the middle; or ``whole``), its ``curves`` by what
    they show, its ``theme`` ("" is that of the spec), the boxes that are ``closed`` by hand, and what it ``shows`` (one
    of ``SHOWN``). What is None stays as it is; ``window`` is that for which the network was laid out, None for none:
    the camera is of that."""

    step: int | None = None
    speed: str | None = None
    camera: tuple[float, float, float] | Literal["whole"] | None = None
    curves: tuple[str, ...] | None = None
    theme: str | None = None
    closed: tuple[str, ...] | None = None
    shows: str | None = None
    window: Window | None = None


def file_beside(spec: Path) -> Path:
    """The file of the views of a spec."""
    return spec.with_name(f"{spec.stem}.neurovis-view.yaml")


def views_in(path: Path, network: Network, findings: Findings) -> dict[str, SavedView]:
    """The views of a file, none where there is none."""
    root = _root(path, findings)
    if root is None:
        return {}
    for entry in root.entries:
        if entry.name not in _KEYS:
            hint = suggest(entry.name, _KEYS, "keys of a file of views")
            findings.error("unknown-key", entry.key.span, f"unknown key '{entry.name}' in a file of views", hint)
    version = root.get("neurovis_view")
    if version is None:
        findings.error("missing-key", root.span, f"a file of views begins with '{_NEW.strip()}'", f"add {_NEW.strip()}")
    elif not isinstance(version, Scalar) or isinstance(version.value, bool) or version.value != VERSION:
        findings.error("wrong-type", version.span, f"expected version {VERSION}, found {describe(version)}")
    views = root.get("views")
    if views is None or (isinstance(views, Scalar) and views.value is None):
        return {}
    if not isinstance(views, Entries):
        findings.error("wrong-type", views.span, f"'views' is a mapping of names, found {describe(views)}")
        return {}
    known = _known(network)
    return {entry.name: _view(entry.name, entry.value, known, findings) for entry in views.entries}


def keep(path: Path, name: str, view: SavedView) -> None:
    """Put a view into a file, in place of one of this name; the file is written as a whole. Raises SpecError where what
    is there cannot be read, ValueError for a text that cannot be seen, OSError."""
    _check_seen(name, *(view.curves or ()), *(view.closed or ()))
    findings = Findings()
    root = _root(path, findings)
    findings.check()
    text = path.read_bytes().decode("utf-8-sig") if path.exists() else ""
    if root is None:
        text += _NEW if not text or text.endswith("\n") else f"\n{_NEW}"
    views = None if root is None else root.get("views")
    if views is not None and not isinstance(views, Entries) and not (isinstance(views, Scalar) and views.value is None):
        findings.error("wrong-type", views.span, f"'views' is a mapping of names, found {describe(views)}")
        findings.check()
    with replacing(path) as file:
        file.write(_with(text, views, name, view).encode())


@dataclass(frozen=True, slots=True)
class Forgotten:
    """The file before and after a view was taken out of it."""

    before: bytes
    after: bytes


def forget(path: Path, name: str) -> Forgotten:
    """Take a view out of a file, which is written as a whole. Raises SpecError where what is there cannot be read,
    KeyError where there is no such view, OSError."""
    return _edit(path, name, lambda text: without(text, ("views", name)))


def restore(path: Path, forgotten: Forgotten) -> bool:
    """Have a file be as it was before a view was taken out of it; False where it has been edited since. Raises
    OSError."""
    if not path.exists() or path.read_bytes() != forgotten.after:
        return False
    with replacing(path) as file:
        file.write(forgotten.before)
    return True


def call(path: Path, name: str, to: str) -> None:
    """Have a view of a file be called otherwise; the file is written as a whole. Raises as ``forget`` does, and
    ValueError for a name that cannot be seen or that another view has."""
    _check_seen(to)
    _edit(path, name, lambda text: recalled(text, ("views", name), _text(to)), to)


def _edit(path: Path, name: str, edited: Callable[[str], str], to: str | None = None) -> Forgotten:
    findings = Findings()
    root = _root(path, findings)
    findings.check()
    views = None if root is None else root.get("views")
    if not isinstance(views, Entries) or views.entry(name) is None:
        raise KeyError(f"there is no view '{name}' in {path.name}")
    if to is not None and to != name and views.entry(to) is not None:
        raise ValueError(f"another view is called '{to}'")
    before = path.read_bytes()
    after = edited(before.decode("utf-8-sig")).encode()
    with replacing(path) as file:
        file.write(after)
    return Forgotten(before, after)


def _check_seen(*texts: str) -> None:
    for text in texts:
        if not text.isprintable():
            raise ValueError(f"what is saved holds characters that cannot be seen: {text!r}")


def _with(text: str, views: Node | None, name: str, view: SavedView) -> str:
    """A text with a view in it. Of one that is there each value is replaced by itself, so that comments stay."""
    before = views.get(name) if isinstance(views, Entries) else None
    key = _text(name) if before is None else name
    values: dict[Keys, Value] = {}
    for what in _OF_VIEW:
        value = getattr(view, what)
        if value is not None or (isinstance(before, Entries) and before.entry(what) is not None):
            values["views", key, what] = _cells(value)
    return put(text, values or {("views", key): "{}"})


def _cells(value: int | str | tuple[float | str, ...] | None) -> Value:
    if value is None:
        return "null"
    if isinstance(value, tuple):
        return tuple(_text(one) if isinstance(one, str) else number_text(one) for one in value)
    return _text(value) if isinstance(value, str) else str(value)


def _text(text: str) -> str:
    """A text that can be seen as YAML has it."""
    if name_text(text) == text:
        return text
    return json.dumps(text, ensure_ascii=False)


def _root(path: Path, findings: Findings) -> Entries | None:
    """The top of a file; None where there is none, or nothing can be read."""
    data = read_bytes(path, LARGEST)
    if isinstance(data, FileFault):
        if data.code != "file-missing":
            findings.error(data.code, Span(path.name, 1, 1, 1, 1), f"the file '{path.name}' {data.reason}")
        return None
    if not any(_SAID.match(line) for line in data.splitlines()):
        return None
    document = read_content(data, path.name, findings)
    return None if document is None else document.root


def _view(name: str, node: Node, known: Callable[[str], bool], findings: Findings) -> SavedView:
    what = f"the view '{name}'"
    if not isinstance(node, Entries):
        findings.error("wrong-type", node.span, f"{what} is a mapping, found {describe(node)}")
        return SavedView()
    for entry in node.entries:
        if entry.name not in _OF_VIEW:
            hint = suggest(entry.name, _OF_VIEW, "keys of a view")
            findings.error("unknown-key", entry.key.span, f"unknown key '{entry.name}' in {what}", hint)

    def given(key: str) -> Node | None:
        value = node.get(key)
        return None if isinstance(value, Scalar) and value.value is None else value

    curves = _texts(given("curves"), "curves", findings)
    return SavedView(
        _step(given("step"), findings),
        _one_of(given("speed"), "speed", SPEEDS, findings),
        _camera(given("camera"), findings),
        None if curves is None else tuple(curve for curve, span in curves if _is_there(curve, span, known, findings)),
        _one_of(given("theme"), "theme", {"": "", **THEMES}, findings),
        _plain(_texts(given("closed"), "closed", findings)),
        _one_of(given("shows"), "shows", {one: one for one in SHOWN}, findings),
        cast(Window | None, _one_of(given("window"), "window", dict.fromkeys(get_args(Window)), findings)),
    )


def _is_there(curve: str, span: Span, known: Callable[[str], bool], findings: Findings) -> bool:
    """Whether the network has all that a curve shows; else that is said."""
    missing = [part for part in _JOINING.split(curve) if not known(part)]
    if missing:
        message = f"the curve '{curve}' shows '{missing[0]}', which this network does not have: it is left out"
        findings.warning("forgotten-neuron", span, message)
    return not missing


def _known(network: Network) -> Callable[[str], bool]:
    """Whether something can be a curve: a name, of one something by its name, or a measure."""
    beside = Beside(network, 0)
    groups = {group.name for group in network.neurons.groups}
    neurons = {*network.neurons.names, *groups}
    names = {*neurons, *network.connection_names, *beside.input_names, *beside.sensor_names}
    names |= {called for called, _ in series_of(network).values()}

    def known(name: str) -> bool:
        ends = name.split(" -> ")
        if name in names or (len(ends) == 2 and neurons.issuperset(ends)):
            return True
        return name.rpartition(".")[0] in names or (len(name) <= LONGEST and not measured(name, network))

    return known


def _step(node: Node | None, findings: Findings) -> int | None:
    value = node.value if isinstance(node, Scalar) else None
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= FARTHEST:
        return value
    if node is not None:
        findings.error("wrong-type", node.span, f"'step' is a step, from 0 on, found {describe(node)}")
    return None


def _one_of(node: Node | None, key: str, words: Mapping[str, object], findings: Findings) -> str | None:
    value = node.value if isinstance(node, Scalar) else None
    if isinstance(value, int | float) and not isinstance(value, bool):
        value = f"{value:g}"
    if isinstance(value, str) and value in words:
        return value
    if node is not None:
        hint = suggest(str(value), [word for word in words if word], f"what '{key}' can be")
        findings.error("wrong-type", node.span, f"'{key}' cannot be {describe(node)}", hint)
    return None


def _camera(node: Node | None, findings: Findings) -> tuple[float, float, float] | Literal["whole"] | None:
    if isinstance(node, Scalar) and node.value == "whole":
        return "whole"
    found = [item.value for item in node.items if isinstance(item, Scalar)] if isinstance(node, AnyList) else []
    numbers = [float(one) for one in found if isinstance(one, int | float) and not isinstance(one, bool)]
    if len(numbers) == len(found) == 3 and all(map(math.isfinite, numbers)) and numbers[0] > 0:
        return numbers[0], numbers[1], numbers[2]
    if node is not None:
        message = "'camera' is a list of three: how many times as large as the whole, and x and y in the middle"
        findings.error("wrong-type", node.span, message, "camera: [1, 0, 0]")
    return None


def _texts(node: Node | None, key: str, findings: Findings) -> list[tuple[str, Span]] | None:
    if node is None:
        return None
    items = node.items if isinstance(node, AnyList) else ()
    found = [(item.value, item.span) for item in items if isinstance(item, Scalar) and isinstance(item.value, str)]
    if not isinstance(node, AnyList) or len(found) != len(items) or len(found) > MOST:
        findings.error("wrong-type", node.span, f"'{key}' is a list of at most {MOST} texts, found {describe(node)}")
        return None
    return [(value, span) for value, span in found]


def _plain(texts: list[tuple[str, Span]] | None) -> tuple[str, ...] | None:
    return None if texts is None else tuple(text for text, _ in texts)
