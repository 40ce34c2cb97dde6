"""Remembering: the earlier layout that a spec names under ``layout.file``.

In: the path as the author wrote it, the folders it may lie in, the network. Out: a Layout that holds what the file says
of this network's neurons. A file that is not there yet is a warning: the layout command makes it (``--update``).
"""

from __future__ import annotations

from pathlib import Path

from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import Findings, Span, shorten
from neurovis_spec.language.data.files import NamedFile, locate
from neurovis_spec.language.located import Located
from neurovis_spec.language.unknown import UNKNOWN
from neurovis_spec.language.yaml.opening import FileFault, read_bytes
from neurovis_spec.language.yaml.reader import LARGEST
from neurovis_spec.layout.file import parse_bytes
from neurovis_spec.layout.model import Layout


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
    return Layout(layout.network, layout.engine, positions, routes, labels)
