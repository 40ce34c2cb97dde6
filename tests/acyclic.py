"""A contract of import-linter: no modules import each other, round a circle of whatever length.

In: the imports of all packages, those for type checking and within functions included. Out: kept, or the circles, each
with the imports that it is made of. import-linter's own contract of the kind is about packages, not single modules.
``benchmarks/house.py`` counts the same circles.
"""

from __future__ import annotations

from collections.abc import Iterator

import networkx as nx
from grimp import ImportGraph
from importlinter import Contract, ContractCheck, output


class AcyclicContract(Contract):
    """``type = "acyclic"``; it has no options."""

    type_name = "acyclic"

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        found = {" <-> ".join(circle): list(imports(graph, circle)) for circle in circles(graph)}
        return ContractCheck(kept=not found, metadata={"circles": found})

    def render_broken_contract(self, check: ContractCheck) -> None:
        for circle, within in check.metadata["circles"].items():
            output.print_error(f"These modules import each other: {circle}", bold=True)
            for one in within:
                output.print_error(f"- {one}", bold=False)
            output.new_line()


def circles(graph: ImportGraph) -> list[list[str]]:
    """The modules that import each other, set by set."""
    all_imports: nx.DiGraph[str] = nx.DiGraph()
    for module in graph.modules:
        all_imports.add_edges_from((module, other) for other in graph.find_modules_directly_imported_by(module))
    return sorted(sorted(part) for part in nx.strongly_connected_components(all_imports) if len(part) > 1)


def imports(graph: ImportGraph, circle: list[str]) -> Iterator[str]:
    """The imports between the modules of a circle, with their lines."""
    for module in circle:
        for other in sorted(graph.find_modules_directly_imported_by(module).intersection(circle)):
            details = graph.get_import_details(importer=module, imported=other)
            lines = ", ".join(str(one["line_number"]) for one in details)
            yield f"{module} -> {other} (line {lines})"
