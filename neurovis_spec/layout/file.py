"""Layout files: a Layout as YAML, and back; and the one that a spec names, to be remembered.

In: a Layout, or a text. Out: a text whose numbers read back exactly, or a Layout. A file that the layout command writes
holds every neuron and every route; one written by hand may hold any part. The one that a spec names may be of an
earlier network: what it says of this network's neurons is remembered. One that is not there yet is a warning: the
layout command makes it (``--update``).
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

from neurovis_spec.compiler.drawing.pins import FARTHEST
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.data.files import NamedFile, locate
from neurovis_spec.language.located import Located
from neurovis_spec.language.unknown import UNKNOWN
from neurovis_spec.language.yaml.opening import FileFault, read_bytes
from neurovis_spec.language.yaml.reader import LARGEST, read_content, read_text
from neurovis_spec.language.yaml.source import AnyList, Mapping, Node, Scalar, SourceDocument, describe
from neurovis_spec.layout.model import DIRECTIONS, SIDES, Direction, Layout, Point, Route, Side
from neurovis_spec.layout.naming import edge_key, natural_key
from neurovis_spec.likeness import suggest

VERSION = 1
_KEYS = ("neurovis_layout", "network", "engine", "direction", "positions", "routes", "labels")
_NAME = r"[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z_][A-Za-z0-9_]*)*"
_PLAIN = re.compile(rf"{_NAME}(?: -> {_NAME}(?: \([0-9]+\))?)?")
#: What some YAML reader takes for something else than a text.
_SPECIAL = frozenset({"null", "true", "false", "yes", "no", "on", "off", "y", "n"})
#: How far out anything may stand: what is arranged around the farthest pins may lie beyond them.
_FARTHEST = 2 * FARTHEST
#: A YAML key this long has to be announced by a question mark.
_LONG_KEY = 1000


def dump(layout: Layout) -> str:
    """The layout as the text of a layout file: positions in natural order of the names, then every route, then on which
    sides those labels stand for which there is room beside their discs; before all these the direction that the page
    chose, where it did.

    >>> print(dump(Layout("x", "grid", {"A": (0.0, 0.5)}, {})), end="")
    neurovis_layout: 1
    network: x
    engine: grid
    positions:
      A: [0, 0.5]
    routes: {}
    """
    lines = [
        f"neurovis_layout: {VERSION}",
        f"network: {name_text(layout.network)}",
        f"engine: {name_text(layout.engine)}",
    ]
    if layout.direction is not None:
        lines.append(f"direction: {layout.direction}")
    positions = sorted(layout.positions, key=natural_key)
    lines += _section("positions", [(name, _point(layout.positions[name])) for name in positions])
    routes = sorted(layout.routes, key=edge_key)
    lines += _section(
        "routes", [(name, "[" + ", ".join(_point(point) for point in layout.routes[name]) + "]") for name in routes]
    )
    if layout.labels:
        lines += _section("labels", [(name, layout.labels[name]) for name in sorted(layout.labels, key=natural_key)])
    return "\n".join(lines) + "\n"


def _section(title: str, entries: list[tuple[str, str]]) -> list[str]:
    if not entries:
        return [f"{title}: {{}}"]
    lines = [f"{title}:"]
    for name, value in entries:
        key = name_text(name)
        lines += [f"  {key}: {value}"] if len(key) < _LONG_KEY else [f"  ? {key}", f"  : {value}"]
    return lines


def name_text(text: str) -> str:
    """Plain where every reader of YAML takes it for a text, else in double quotes (JSON's are YAML's, too)."""
    plain = _PLAIN.fullmatch(text) is not None and text.casefold() not in _SPECIAL
    return text if plain else json.dumps(text, ensure_ascii=True)


def _point(point: Point) -> str:
    return f"[{number_text(point[0])}, {number_text(point[1])}]"


def number_text(value: float) -> str:
    """The shortest text that reads back as this number; whole ones without a point."""
    value = float(value) + 0.0
    if value.is_integer() and abs(value) < 2**53:
        return str(int(value))
    text = repr(value)
    # an exponent without a point is no number to every reader of YAML
    return text if "e" not in text or "." in text else text.replace("e", ".0e")


def parse(text: str, file: str, findings: Findings) -> Layout | None:
    """The layout that a text holds; None where something is wrong with it, which is then among the findings.

    ``network`` and ``engine`` may be missing (then '' and 'manual'), and so may any neuron and any route.
    """
    before = findings.errors
    return _parsed(read_text(text, file, findings), before, findings)


def parse_bytes(data: bytes, file: str, findings: Findings) -> Layout | None:
    """The same of the bytes of a file."""
    before = findings.errors
    return _parsed(read_content(data, file, findings), before, findings)


def _parsed(document: SourceDocument | None, before: int, findings: Findings) -> Layout | None:
    if document is None or findings.errors > before:
        return None
    root = document.root
    for entry in root.entries:
        if entry.name not in _KEYS:
            hint = suggest(entry.name, _KEYS, "keys of a layout file")
            findings.error("unknown-key", entry.key.span, f"unknown key '{entry.name}' in a layout file", hint)
    _check_version(root, findings)
    network = _name(root, "network", "", findings)
    engine = _name(root, "engine", "manual", findings)
    positions: dict[str, Point] = {}
    for name, node in _entries(root, "positions", findings):
        point = _read_point(node, f"the position of '{name}'", findings)
        if point is not None:
            positions[name] = point
    routes: dict[str, Route] = {}
    for name, node in _entries(root, "routes", findings):
        route = _read_route(node, name, findings)
        if route is not None:
            routes[name] = route
    labels: dict[str, Side] = {}
    for name, node in _entries(root, "labels", findings):
        side = _read_side(node, name, findings)
        if side is not None:
            labels[name] = side
    direction = _direction(root, findings)
    return None if findings.errors > before else Layout(network, engine, positions, routes, labels, direction)


def _check_version(root: Mapping, findings: Findings) -> None:
    node = root.get("neurovis_layout")
    if node is None:
        findings.error(
            "missing-key", root.span, "a layout file begins with 'neurovis_layout: 1'", "add neurovis_layout: 1"
        )
    elif not isinstance(node, Scalar) or isinstance(node.value, bool) or node.value != VERSION:
        findings.error("layout-version", node.span, f"expected version {VERSION}, found {describe(node)}")


def _name(root: Mapping, key: str, default: str, findings: Findings) -> str:
    node = root.get(key)
    if node is None:
        return default
    if not isinstance(node, Scalar) or not isinstance(node.value, str):
        findings.error("wrong-type", node.span, f"'{key}' is a name, found {describe(node)}")
        return default
    return node.value


def _direction(root: Mapping, findings: Findings) -> Direction | None:
    node = root.get("direction")
    value = node.value if isinstance(node, Scalar) else None
    for direction in DIRECTIONS:
        if direction == value:
            return direction
    if node is not None:
        hint = suggest(value, DIRECTIONS, "directions") if isinstance(value, str) else None
        findings.error("wrong-type", node.span, f"'direction' is one of four, found {describe(node)}", hint)
    return None


def _entries(root: Mapping, key: str, findings: Findings) -> list[tuple[str, Node]]:
    node = root.get(key)
    if node is None or (isinstance(node, Scalar) and node.value is None):
        return []
    if not isinstance(node, Mapping):
        findings.error("wrong-type", node.span, f"'{key}' is a mapping of names, found {describe(node)}")
        return []
    return [(entry.name, entry.value) for entry in node.entries]


def _read_point(node: Node, what: str, findings: Findings) -> Point | None:
    items = node.items if isinstance(node, AnyList) else ()
    if len(items) != 2:
        found = f"a list of {len(items)}" if isinstance(node, AnyList) else describe(node)
        findings.error("wrong-type", node.span, f"{what} is a pair [x, y], found {found}")
        return None
    x, y = (_read_number(item, what, findings) for item in items)
    return None if x is None or y is None else (x, y)


def _read_number(node: Node, what: str, findings: Findings) -> float | None:
    value = node.value if isinstance(node, Scalar) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        findings.error("wrong-type", node.span, f"{what} has a number here, found {describe(node)}")
        return None
    if not math.isfinite(value):
        findings.error("not-finite", node.span, f"{what} has a number that is not finite")
        return None
    if abs(value) > _FARTHEST:
        findings.error("out-of-range", node.span, f"{what} lies within {_FARTHEST:g} of the origin")
        return None
    return float(value)


def _read_side(node: Node, name: str, findings: Findings) -> Side | None:
    value = node.value if isinstance(node, Scalar) else None
    for side in SIDES:
        if side == value:
            return side
    where = f"{', '.join(SIDES[:-1])} or {SIDES[-1]}"
    hint = suggest(value, SIDES, "sides") if isinstance(value, str) else None
    findings.error("wrong-type", node.span, f"the label of '{name}' stands {where}, found {describe(node)}", hint)
    return None


def _read_route(node: Node, name: str, findings: Findings) -> Route | None:
    what = f"the route of '{name}'"
    if not isinstance(node, AnyList):
        findings.error("wrong-type", node.span, f"{what} is a list of points, found {describe(node)}")
        return None
    items = node.items
    points = [_read_point(item, what, findings) for item in items]
    if len(items) < 4 or len(items) % 3 != 1:
        findings.error(
            "route-points",
            node.span,
            f"{what} has {len(items)} points; a cubic Bézier spline has 4, 7, 10, …",
            "the centre of the source, then two control points and an end for each piece",
        )
        return None
    whole = tuple(point for point in points if point is not None)
    return whole if len(whole) == len(items) else None


def read_memory(path: Located[str], folder: Path, root: Path, network: Network, findings: Findings) -> Layout | None:
    """The earlier layout, without what it says of neurons that this network does not have, which is a warning.

    Codes: those of data files, those of layout files, ``layout-file-missing`` and ``forgotten-neuron`` (warnings).
    """
    place = locate(NamedFile(path.value, root, folder, path.span), findings)
    if place is UNKNOWN:
        return None
    data = read_bytes(place, LARGEST)
    if isinstance(data, FileFault):
        if data.code == "file-missing":
            message = f"there is no layout file '{shorten(path.value)}' yet"
            hint = f"make it with: neurovis layout SPEC --update {path.value}"
            findings.warning("layout-file-missing", path.span, message, hint)
        else:
            findings.error(data.code, path.span, f"the file '{shorten(path.value)}' {data.reason}")
        return None
    name = str(Path(path.span.file).parent / path.value)
    layout = parse_bytes(data, name, findings)
    return None if layout is None else known_part(layout, network, path.span, findings)


def known_part(layout: Layout, network: Network, span: Span, findings: Findings) -> Layout:
    """What a layout says of the neurons of a network; names that this does not have are a warning at ``span``."""
    strange = [name for name in layout.positions if name not in network.neuron_index]
    if strange:
        more = f" and {len(strange) - 1} more" if len(strange) > 1 else ""
        message = f"the layout file places '{strange[0]}'{more}, which this network does not have"
        findings.warning("forgotten-neuron", span, message, "neurovis layout --update takes them out")
    positions = {name: point for name, point in layout.positions.items() if name in network.neuron_index}
    routes = {name: route for name, route in layout.routes.items() if name in network.connection_index}
    labels = {name: side for name, side in layout.labels.items() if name in network.neuron_index}
    return Layout(layout.network, layout.engine, positions, routes, labels, layout.direction)
