"""What a hostile spec, data file, recording or checkpoint costs: seconds, memory, and which files were opened.

Each case is compiled, or loaded, in a process of its own, forked from one that has compiled a small spec. Seconds are
of the processor, so that a busy machine tells the same; memory is the growth of the largest resident memory over that
before the case. Run with ``python benchmarks/robustness.py [NAME]…``. Status 1 where something else than findings came
out, a file was opened that nobody may open, or a budget was missed clearly (seconds by 10 times, memory by 3 times).
"""

from __future__ import annotations

import io
import json
import multiprocessing
import os
import random
import resource
import socket
import struct
import sys
import tempfile
import time
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np
import pyarrow
import pyarrow.parquet
from robustness_runs import RUNS, SUFFIXES, Attempt, network

import neurovis_spec as nv
from neurovis_spec.diagnostics import show_text

HEAD = "neurovis: 1\nname: x\n"
SMALL = HEAD + "parameters: {a: 1}\nneurons: {A: {activation: tahn, bias: 2*a}}\nconnections: {A -> A: 1}\n"
#: How often a budget of seconds, or of memory, may be missed before it is a failure.
CLEARLY_SLOW, CLEARLY_LARGE = 10, 3
#: Seconds after which a case is given up.
LONGEST = 60


@dataclass(frozen=True, slots=True)
class Case:
    """A spec, the files beside it, and what it may cost. ``closed``: no file but the spec may be opened; ``drawn``: it
    is laid out, too."""

    text: str
    files: Callable[[Path], None] | None = None
    seconds: float = 0.1
    mib: float = 20
    closed: bool = False
    drawn: bool = False
    #: what is done instead of compiling, with a file of this suffix
    loaded: Callable[[Path], list[str]] | None = None
    suffix: str = ".yaml"


@dataclass(frozen=True, slots=True)
class Result:
    """What a case cost: seconds, growth in MiB; the codes of its findings, and the files opened besides the spec."""

    seconds: float
    mib: float
    codes: list[str]
    opened: list[str]


def _bomb() -> str:
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 9)}]" for i in range(1, 10)]
    return HEAD + "neurons: {A: {}}\n" + "\n".join(lines) + "\n"


def _doubled(kind: str) -> str:
    """Each value twice the one before: 2^100 terms, were they written out."""
    names = [f"v{i}" for i in range(100)]
    pairs = ["v0: x + x" if kind == "let" else "v0: 1 + 1"]
    pairs += [f"{name}: {before} + {before}" for before, name in pairwise(names)]
    body = ", ".join(pairs)
    if kind == "let":
        return HEAD + f"activations: {{f: {{let: {{{body}}}, value: v99}}}}\nneurons: {{A: {{activation: f}}}}\n"
    return HEAD + f"parameters: {{{body}}}\nneurons: {{A: {{bias: v99}}}}\n"


def _group(settings: str) -> str:
    return HEAD + f"neurons: {{A: {{{settings}}}}}\n"


def _pair(body: str, sizes: str = "100000") -> str:
    return HEAD + f"neurons: {{A: {{count: {sizes}}}, B: {{count: {sizes}}}}}\nconnections: {{A -> B: {body}}}\n"


def _tied(entries: str, sizes: str = "10") -> str:
    """Two groups, and entries that are tied to each other."""
    groups = ", ".join(f"{name}: {{count: {sizes}}}" for name in "ABC")
    return HEAD + f"neurons: {{{groups}}}\nconnections:\n{entries}"


def _instances(count: int, neurons: int) -> str:
    module = f"modules: {{leg: {{neurons: {{A: {{count: {neurons}, bias: 1}}}}}}}}\n"
    return HEAD + module + f"instances: {{left: {{module: leg, count: {count}}}}}\n"


def _levels(depth: int, count: str, given: str) -> str:
    """Modules within modules; in ``given``, what each is given, # is the level."""
    text = HEAD + f"modules:\n  m{depth}: {{parameters: {{p: 1}}, neurons: {{A: {{count: p, bias: 1}}}}}}\n"
    for level in range(depth):
        inner = f'{{module: m{level + 1}, count: "{count}", set: {{p: {given.replace("#", str(level))}}}}}'
        text += f"  m{level}: {{parameters: {{p: 1}}, instances: {{x: {inner}}}}}\n"
    return text + "instances: {x: {module: m0}}\n"


def _ends(key: str) -> str:
    """A connection with this key, which is too long for a plain one."""
    return HEAD + f"neurons: {{A: {{}}}}\nconnections:\n  ? {key}\n  : 1\n"


def _unknown(section: str, line: str, before: str = "") -> str:
    """A section of 20,000 lines."""
    return HEAD + before + section + "".join(line.replace("#", str(number)) for number in range(20_000))


def _misspelt(section: str, value: str, key: str, wrong: str, count: int = 8000) -> str:
    """So many names, each used by a neuron that misspells it."""
    names = "".join(f"  gain{number}_: {value}\n" for number in range(count))
    used = "".join(f"  A{number}_: {{{key}: {wrong}{number}_}}\n" for number in range(count))
    return HEAD + f"{section}:\n{names}neurons:\n{used}"


#: Small texts that would become something huge.
BOMBS: dict[str, Case] = {
    "aliases of aliases": Case(_bomb()),
    "an alias of itself": Case(HEAD + "neurons: &a {A: *a, B: [*a, *a]}\n"),
    "100,000 aliases of a text": Case(
        HEAD + f"title: &a {'x' * 1000}\nauthors: [{', '.join(['*a'] * 100_000)}]\nneurons: {{A: {{}}}}\n"
    ),
    "brackets 100,000 deep": Case(HEAD + "neurons: " + "[" * 100_000),
    "braces 100,000 deep": Case(HEAD + "neurons: " + "{a: " * 100_000),
    "dashes 10,000 deep": Case(HEAD + "neurons:\n" + "- " * 10_000),
    "question marks 10,000 deep": Case("? " * 10_000),
    "blocks 1,000 deep": Case(HEAD + "neurons:\n" + "".join(" " * (i + 1) + "a:\n" for i in range(1000))),
    "an integer of a million digits": Case(_group("bias: " + "9" * 1_000_000)),
    "a float of a million digits": Case(_group("bias: 0." + "9" * 1_000_000)),
    "an exponent of a million digits": Case(_group("bias: 1e" + "9" * 1_000_000)),
    "10,000 integers of 100 digits": Case(_group("bias: [" + ", ".join(["9" * 100] * 10_000) + "]"), seconds=0.5),
    "the largest count": Case(_group("count: 9223372036854775807")),
    "a count of 1e9": Case(_group("count: 1e9")),
    "a count of 9^9^9^9": Case(_group("count: 9^9^9^9")),
    "the largest first": Case(_group("count: 2, first: 9223372036854775807")),
    "a range of 1e18": Case(_group("count: 2") + "outputs: {y: A1..A999999999999999999}\n"),
    "100,000 to 100,000": Case(_pair("{pattern: all_to_all}"), seconds=0.3, mib=80),
    "random 100,000 to 100,000": Case(_pair("{pattern: {random: {probability: 1}}}"), seconds=0.3, mib=80),
    "30,000 instances of 40 neurons": Case(_instances(30_000, 40)),
    "10^18 instances": Case(_levels(60, "2", "p")),
    "10^18 instances, each set differently": Case(_levels(60, "2", "p + i*2^#")),
    "counts that are set at 12 levels": Case(_levels(12, "floor(min(p, 3)) + 3", "p + i/1000")),
    "an indegree of 1e18": Case(_pair("{pattern: {fixed_indegree: {count: 1000000000000000000}}}", "10")),
    "a band of 1e18": Case(_pair("{pattern: {band: {width: 1000000000000000000}}}", "10")),
    "an expression for each of 10^10 pairs": Case(_pair("{where: i == j}"), seconds=0.3, mib=80),
    "a probability for each of 10^10 pairs": Case(
        _pair("{pattern: {random: {probability: exp(-abs(i - j))}}}"), seconds=0.3, mib=80
    ),
    "a where of 4·10^8 pairs that holds of none": Case(_pair("{where: i > 1e9}", "20000"), seconds=6, mib=60),
    "a where of 4·10^6 pairs that holds of all": Case(_pair("{where: i >= 0}", "2000"), seconds=1, mib=200),
    "a where of 10^8 pairs, not defined at the last": Case(
        _pair("{where: (i > 1e9)/(i + j - 19998)}", "10000"), seconds=2, mib=60
    ),
    "a probability of 10^8 pairs beyond 1": Case(
        _pair("{pattern: {random: {probability: i*j}}}", "10000"), seconds=2, mib=60
    ),
    "weights of 10^6 pairs beyond all numbers": Case(
        _pair("{weight: exp(i*j), pattern: all_to_all}", "1000"), seconds=2, mib=200
    ),
    "a where 400 deep": Case(_pair('{where: "' + "(" * 400 + "i" + ")" * 400 + '"}', "10")),
    "a count of 1e18 for each target": Case(_pair("{pattern: {fixed_indegree: {count: (j + 1)*1e18}}}", "10")),
    "a drawn count of 1e18": Case(_pair("{pattern: {total: {count: poisson(1e18), multapses: true}}}", "10")),
    "a total of 1e9 with multapses": Case(_pair("{pattern: {total: {count: 1e9, multapses: true}}}", "10")),
    "ties in a circle": Case(
        _tied("".join(f"  A -> {a}: {{weight: {{same_as: A -> {b}}}}}\n" for a, b in ("BC", "CA", "AB")))
    ),
    "an entry tied to itself": Case(_tied("  A -> B: {weight: {transpose: A -> B}}\n")),
    "ties to 100,000 to 100,000": Case(
        _tied("  A -> B: {pattern: all_to_all}\n  B -> C: {weight: {same_as: A -> B}}\n", "100000"), seconds=0.5, mib=80
    ),
    "the largest delay": Case(_pair("{pattern: one_to_one, delay: 9223372036854775807}", "10")),
    "an input of 1e12": Case(HEAD + "inputs: {s: {size: 1000000000000}}\nneurons: {A: {input: s}}\n"),
    "a picture of 1e9 by 1e9": Case(_group("") + "render: {size: [1000000000, 1000000000]}\n"),
    "an expression of a million characters": Case(_group("bias: " + "1+" * 500_000 + "1")),
    "an expression 400 deep": Case(_group('bias: "' + "(" * 400 + "1" + ")" * 400 + '"')),
    "signs 990 deep": Case(_group('bias: "' + "-" * 990 + '1"')),
    "powers of powers": Case(_group("bias: 9^9^9^9^9^9^9^9")),
    "parameters doubled 100 times": Case(_doubled("parameters")),
    "let doubled 100 times": Case(_doubled("let")),
}

#: Large texts: what they cost may grow with their size, and no faster.
LARGE: dict[str, Case] = {
    "a key of 1 MB": Case(HEAD + "neurons: {" + "x" * 1_000_000 + ": {}}\n", seconds=0.3),
    "a line of 1 MB, wrong at its end": Case(_group("label: '" + "x" * 1_000_000 + "'}, B: ]"), seconds=0.3),
    "1 MB of words": Case(_group("label: " + "a:b" + " c#d" * 250_000), seconds=0.5),
    "1 MB of quotes": Case(_group("label: '" + "''" * 500_000 + "'"), seconds=1),
    "1 MB of quotes, not closed": Case(_group("label: '" + "''" * 500_000), seconds=1),
    "1 MB of backslashes": Case(_group('label: "' + "\\\\" * 500_000 + '"'), seconds=1),
    "1 MB of blanks": Case(_group("bias: " + " " * 1_000_000 + "1"), seconds=0.3),
    "1 MB of line ends": Case(HEAD + "\n" * 1_000_000 + "neurons: {A: {}}\n", seconds=0.3),
    "1 MB of comments": Case(HEAD + "# x\n" * 250_000 + "neurons: {A: {}}\n", seconds=0.3),
    "1 MB of allows": Case(_group("") + "# neurovis: allow x, y\n" * 40_000, seconds=2, mib=60),
    "an allow of 1 MB": Case(_group("") + "# neurovis: allow " + "x, " * 330_000 + "\n", seconds=2, mib=60),
    "100,000 references in an end": Case(_ends("A + " * 100_000 + "A -> A"), seconds=1, mib=60),
    "100,000 arrows in a key": Case(_ends("A -> " * 100_000 + "A"), seconds=1, mib=60),
    "a reference of 1 MB of dots": Case(_group("") + "outputs: {y: " + "." * 1_000_000 + "}\n", seconds=0.3),
    "20,000 unknown keys": Case(_unknown("neurons:\n  A:\n", "    bais#: 1\n"), seconds=2, mib=60),
    "20,000 unknown names": Case(_unknown("neurons:\n", "  A#_: {bias: alpha#}\n"), seconds=4, mib=150),
    "20,000 unknown ends": Case(
        _unknown("connections:\n", "  B#_ -> A#_: 1\n", "neurons: {A: {}}\n"), seconds=4, mib=150
    ),
    "2,000 wheres, none of which is defined": Case(
        _tied("  - A -> B: {where: 1/(i - j)}\n" * 2000),
        seconds=2,
        mib=60,
    ),
    "2,000 ties to an entry that is not there": Case(
        _tied("".join(f"  - A -> B: {{weight: {{same_as: K{k} -> B}}}}\n" for k in range(2000))), seconds=3, mib=60
    ),
    "2,000 ties to one entry": Case(
        _tied("  - A -> B: {pattern: all_to_all}\n" + "  - A -> C: {weight: {same_as: A -> B}}\n" * 2000),
        seconds=2,
        mib=60,
    ),
    "8,000 misspelt parameters": Case(_misspelt("parameters", "1", "bias", "gian"), seconds=3, mib=60),
    "2,000 misspelt inputs": Case(_misspelt("inputs", "{}", "input", "gian", 2000), seconds=3, mib=60),
    "50,000 keys of one name": Case(HEAD + "neurons:\n" + "  A: {}\n" * 50_000, seconds=1, mib=60),
    "50,000 anchors": Case(HEAD + "authors:\n" + "  - &a x\n" * 50_000, seconds=0.5),
    "50,000 tags": Case(HEAD + "authors:\n" + "  - !!str x\n" * 50_000, seconds=0.5),
    "50,000 directives": Case("%YAML 1.1\n" * 50_000 + "---\n" + SMALL, seconds=0.5),
    "50,000 documents": Case("---\n" * 50_000 + SMALL, seconds=0.5),
    "130,000 small mappings": Case(HEAD + "x: [" + ", ".join(["{a: 1}"] * 130_000) + "]\n", seconds=4, mib=150),
    "100,000 empty lists": Case(HEAD + "neurons: [" + "[], " * 100_000 + "]", seconds=1, mib=40),
    "1 MB of control characters": Case(_group("label: '" + "\x01" * 1_000_000 + "'"), seconds=0.5),
    "1 MB of escaped ones": Case(_group('label: "' + "\\x01" * 250_000 + '"'), seconds=0.5),
    "1 MB of accents": Case(_group("label: e" + "\u0301" * 500_000), seconds=0.5),
}  # fmt: skip


def _write(name: str, data: bytes) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        (folder / name).write_bytes(data)

    return write


def _npy(header: str, data: bytes = b"", version: int = 1) -> bytes:
    written = header.encode() + b"\n"
    size = struct.pack("<H", len(written)) if version == 1 else struct.pack("<I", len(written))
    return b"\x93NUMPY" + bytes([version, 0]) + size + written + data


def _saved(array: np.ndarray) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=True)
    return stream.getvalue()


def _zip(entries: dict[str, bytes]) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in entries.items():
            archive.writestr(name, data)
    return stream.getvalue()


def _file(name: str, data: bytes, seconds: float = 0.2, mib: float = 60) -> Case:
    body = f"{{file: {name}}}"
    text = HEAD + f"neurons: {{A: {{count: 2}}, B: {{count: 2}}}}\nconnections: {{A -> B: {{matrix: {body}}}}}\n"
    return Case(text, _write(name, data), seconds, mib)


def _input(name: str, data: bytes, seconds: float = 0.2, mib: float = 60) -> Case:
    """A file in a place that takes a table of any size."""
    return Case(
        HEAD + f"inputs: {{s: {{file: {name}}}}}\nneurons: {{A: {{input: s}}}}\n", _write(name, data), seconds, mib
    )


def _edges(data: bytes, seconds: float = 0.2, mib: float = 60) -> Case:
    text = HEAD + "neurons: {A: {}, B: {}}\nconnections: {A -> B: {edges: {file: e.csv}}}\n"
    return Case(text, _write("e.csv", data), seconds, mib)


def _parquet(rows: int) -> bytes:
    """A Parquet file of so many equal rows."""
    column = pyarrow.DictionaryArray.from_arrays(pyarrow.array(np.zeros(rows, dtype=np.int8)), pyarrow.array([1.5]))
    stream = io.BytesIO()
    pyarrow.parquet.write_table(pyarrow.table(dict.fromkeys("nxyz", column)), stream)
    return stream.getvalue()


def _damaged(data: bytes) -> bytes:
    """The same with bytes of its pages turned over."""
    return data[:10] + bytes(255 - byte for byte in data[10:60]) + data[60:]


def _their_edges(data: bytes, seconds: float = 0.2, mib: float = 60) -> Case:
    """Edges by columns of others, of rows that are picked, with a value in a further column."""
    columns = "columns: {from: a, to: b}, where: {c: x}"
    body = f"{{edges: {{file: e.tsv, {columns}}}, plasticity: {{decay: {{rate: {{column: d}}}}}}}}"
    text = HEAD + f"neurons: {{A: {{}}, B: {{}}}}\nconnections: {{A -> B: {body}}}\n"
    return Case(text, _write("e.tsv", data), seconds, mib)


def _sheet(data: bytes, name: str = "a.csv", seconds: float = 0.2, mib: float = 60, count: int = 2) -> Case:
    """A table of which two settings take columns, by the names of neurons and in order."""
    by, order = f"{{file: {name}, by: n, column: x}}", f"{{file: {name}, column: y, where: {{z: 1}}}}"
    text = HEAD + f"neurons: {{K: {{count: {count}, bias: {by}, initial: {order}}}}}\n"
    return Case(text, _write(name, data), seconds, mib)


def _header(shape: str, descr: str = "'<f8'") -> str:
    return f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}, }}"


#: Data files that lie, or are what they should not be.
FILES: dict[str, Case] = {
    ".npy of 1e12 numbers, it says": _file("a.npy", _npy(_header("(1000000, 1000000)"), b"\0" * 64)),
    ".npy of −1 rows": _file("a.npy", _npy(_header("(-1, 2)"), b"\0" * 64)),
    ".npy of 2^64 rows": _file("a.npy", _npy(_header("(18446744073709551616, 2)"), b"\0" * 64)),
    ".npy of 1,000 dimensions": _file("a.npy", _npy(_header("(" + "1, " * 1000 + ")"), b"\0" * 64)),
    ".npy with a header of brackets": _file("a.npy", _npy("(" * 9000)),
    ".npy with a header of 10 MB": _file("a.npy", _npy("{" + "'a': 1, " * 1_000_000 + "}", version=2)),
    ".npy with a header of 4 GB, it says": _file("a.npy", b"\x93NUMPY\x02\x00\xff\xff\xff\xff{"),
    ".npy that unpickles": _file("a.npy", _saved(np.array([{"a": 1}], dtype=object))),
    ".npy of structures": _file("a.npy", _saved(np.zeros(2, dtype=[("a", "f8"), ("b", "f8")]))),
    ".npy of NaN": _file("a.npy", _saved(np.full((2, 2), np.nan))),
    ".npy cut off": _file("a.npy", _saved(np.zeros((2, 2)))[:-8]),
    ".npz of 64 MiB of zeros in 64 KiB": _file(
        "a.npz", _zip({"a.npy": _npy(_header("(8192, 1024)")) + bytes(1 << 26)})
    ),
    ".npz of 64 MiB, as an input": _input(
        "a.npz", _zip({"a.npy": _npy(_header("(8192, 1024)")) + bytes(1 << 26)}), 1, 270
    ),
    ".npz of 1 GiB, it says": _file("a.npz", _zip({"a.npy": _npy(_header("(131072, 1024)")) + bytes(1 << 10)})),
    ".npz that is none": _file("a.npz", b"PK\x03\x04" + b"\0" * 100),
    ".npz of 20,000 arrays": _file("a.npz", _zip({f"a{i}.npy": b"" for i in range(20_000)})),
    ".mtx of 1e12 entries, it says": _file(
        "a.mtx", b"%%MatrixMarket matrix coordinate real general\n1000000 1000000 1000000000000\n1 1 1\n"
    ),
    ".csv with a cell of 10 MB": _file("a.csv", b"1," + b"9" * 10_000_000 + b"\n"),
    ".csv with a row of a million cells": _file("a.csv", b"1," * 1_000_000 + b"x\n"),
    "the same, an input of a million": _input("a.csv", b"1," * 1_000_000 + b"x\n", 0.4),
    ".csv of 200,000 rows, the last ragged": _file("a.csv", b"1,2\n" * 200_000 + b"3\n"),
    "the same, an input of two": _input("a.csv", b"1,2\n" * 200_000 + b"3\n"),
    ".csv of 31 million commas": _file("a.csv", (b"," * 5567 + b"\n") * 5568, mib=80),
    "the same, an input of 5,568": _input("a.csv", (b"," * 5567 + b"\n") * 5568, 2, 400),
    ".csv of NUL bytes": _file("a.csv", b"\0" * 1_000_000),
    ".csv with a quote never closed": _file("a.csv", b'"' + b"1,2\n" * 250_000),
    "edges: 200,000 rows, the last ragged": _edges(b"from,to,weight\n" + b"A,B,1\n" * 200_000 + b"A\n"),
    "edges: a header of a million cells": _edges(b"from," * 1_000_000),
    "their edges: 200,000 rows, the last ragged": _their_edges(
        b"a\tb\tc\td\n" + b"A\tB\tx\t1\n" * 200_000 + b"A\n", 0.4
    ),
    "their edges: 200,000 kinds of row": _their_edges(
        b"a\tb\tc\td\n" + b"".join(b"A\tB\tx%d\t1\n" % k for k in range(200_000)), 1, 80
    ),
    "their edges: no row counts": _their_edges(b"a\tb\tc\td\n" + b"A\tB\ty\t1\n" * 200_000, 0.4),
    "their edges: a header of a million cells": _their_edges(b"a\t" * 1_000_000 + b"b\tc\td\n"),
    "their edges: blanks alone": _their_edges(b" " * 10_000_000, 0.5, 80),
    "a table: 200,000 rows, the last ragged": _sheet(b"n;x;y;z\n" + b"K1;1;1;1\n" * 200_000 + b"K2\n", seconds=1),
    "a table: 200,000 names, one twice": _sheet(
        b"n,x,y,z\n" + b"".join(b"K%d,1,1,1\n" % k for k in range(200_000)) + b"K1,1,1,1\n", seconds=1, mib=100
    ),
    "a table: 100,000 neurons of which no row is": _sheet(
        b"n,x,y,z\n" + b"".join(b"L%d,1,1,1\n" % k for k in range(100_000)), seconds=1, mib=100, count=100_000
    ),
    "a table: 200,000 rows in quotes": _sheet(b'n,x,y,z\n"K1",1,"y",1\n' * 200_000, seconds=3.5, mib=110),
    "a table: a quote never closed": _sheet(b'n,x,y,z\n"' + b"K1,1,1,1\n" * 200_000),
    "a table: a header of a million cells": _sheet(b"n," * 1_000_000 + b"x,y,z\n"),
    "a table: 31 million separators": _sheet(
        b"n;x;y;z" + b";" * 900 + b"\n" + (b";" * 903 + b"\n") * 34_000, mib=500, seconds=4
    ),
    "a table: a cell of 10 MB": _sheet(b"n x y z\nK1 " + b"9" * 10_000_000 + b" 1 1\n", seconds=0.7),
    "a table: NUL bytes": _sheet(b"n\tx\ty\tz\n" + b"\0" * 1_000_000, "a.tsv"),
    "a table: numbers beyond double precision": _sheet(b"n,x,y,z\n" + b"K1,1e999,1e999,1\n" * 100_000, seconds=1),
    "a table: .npz of 1 GiB, it says": _sheet(
        _zip({f"{name}.npy": _npy(_header("(134217728,)")) + bytes(1 << 10) for name in "nxyz"}), "a.npz"
    ),
    "a table: .npz of 64 MiB of zeros a column": _sheet(
        _zip({f"{name}.npy": _npy(_header("(8388608,)")) + bytes(1 << 26) for name in "nxyz"}), "a.npz"
    ),
    "a table: .npz of texts of 4 GB, it says": _sheet(
        _zip({f"{name}.npy": _npy(_header("(1,)", "'<U999999999'")) + bytes(64) for name in "nxyz"}), "a.npz"
    ),
    "a table: .npz that unpickles": _sheet(_zip({"n.npy": _saved(np.array([{"a": 1}], dtype=object))}), "a.npz"),
    "a table: .parquet cut off": _sheet(_parquet(10)[:-6], "a.parquet", 0.5, 120),
    "a table: .parquet of 50 million equal rows": _sheet(_parquet(50_000_000), "a.parquet", 0.5, 120),
    "a table: .parquet with other bytes within": _sheet(_damaged(_parquet(1000)), "a.parquet", 0.5, 120),
    "a table that is a picture": _sheet(b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 400),
    ".csv that is a picture": _file("a.csv", b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 400),
}


def _pipe(folder: Path) -> None:
    os.mkfifo(folder / "data.csv")


def _socket(folder: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(folder / "data.csv"))


def _link(target: str) -> Callable[[Path], None]:
    return lambda folder: (folder / "data.csv").symlink_to(target)


def _loop(folder: Path) -> None:
    (folder / "data.csv").symlink_to("data.csv")


def _linked_folder(folder: Path) -> None:
    (folder / "below").symlink_to("/etc")


def _path(path: str, files: Callable[[Path], None] | None = None) -> Case:
    return Case(
        HEAD + f"inputs: {{s: {{file: {json.dumps(path)}}}}}\nneurons: {{A: {{input: s}}}}\n", files, closed=True
    )


#: What may not be opened.
PATHS: dict[str, Case] = {
    "a path upwards": _path("../data.csv"),
    "an absolute path": _path("/etc/passwd.csv"),
    "a path of another system": _path("C:\\data.csv"),
    "a device": _path("/dev/zero"),
    "a link to a device": _path("data.csv", _link("/dev/zero")),
    "a link to a file outside": _path("data.csv", _link("/etc/hostname")),
    "a link to itself": _path("data.csv", _loop),
    "a folder that is a link": _path("below/hostname.csv", _linked_folder),
    "a pipe": _path("data.csv", _pipe),
    "a socket": _path("data.csv", _socket),
    "a folder": _path("data.csv", lambda folder: (folder / "data.csv").mkdir()),
    "a path with NUL": _path("data\0.csv"),
    "a path of 100,000 characters": _path("a/" * 50_000 + "data.csv"),
}


def _linked(count: int, links: int, engine: str) -> str:
    """Instances, connected at random."""
    draw = random.Random(1)
    module = "modules: {leg: {neurons: {S: {bias: 1}, K: {}}, connections: {S -> K: 1}}}\n"
    ends = [(draw.randint(1, count), draw.randint(1, count)) for _ in range(links)]
    between = "".join(f"  - l{a}.K -> l{b}.S: 1\n" for a, b in ends)
    instances = f"instances: {{l: {{module: leg, count: {count}}}}}\nlayout: {{engine: {engine}}}\n"
    return f"{HEAD}{module}{instances}connections:\n{between}"


_LOOPS = HEAD + "neurons: {A: {bias: 1}}\nconnections:\n" + "  - A -> A: 1\n" * 80
_PARALLEL = HEAD + "neurons: {A: {bias: 1}, B: {}}\nconnections:\n" + "  - A -> B: 1\n" * 100
#: What is hard to draw.
LAYOUTS: dict[str, Case] = {
    "80 loops of a neuron": Case(_LOOPS, seconds=1, mib=100, drawn=True),
    "100 connections between two": Case(_PARALLEL, seconds=1.5, mib=100, drawn=True),
    "200 instances in circles": Case(_linked(200, 400, "circular"), seconds=10, mib=100, drawn=True),
    "1,000 instances in a grid": Case(_linked(1000, 1000, "grid"), seconds=20, mib=300, drawn=True),
}


def _attempts(title: str, attempts: dict[str, Attempt]) -> dict[str, Case]:
    suffix = SUFFIXES[title]
    return {
        name: Case(
            "",
            lambda folder, data=one.data: (folder / f"spec{suffix}").write_bytes(data()),  # type: ignore[misc]
            one.seconds,
            one.mib,
            loaded=one.load,
            suffix=suffix,
        )
        for name, one in attempts.items()
    }


GROUPS = {
    "bombs": BOMBS,
    "large texts": LARGE,
    "data files": FILES,
    "paths": PATHS,
    "layouts": LAYOUTS,
    **{title: _attempts(title, attempts) for title, attempts in RUNS.items()},
}


def _peak() -> float:
    """The largest resident memory so far, in MiB; since the last ``_forget``, where the system can forget."""
    status = Path("/proc/self/status")
    if status.exists():
        for line in status.read_text().splitlines():
            if line.startswith("VmHWM:"):
                return int(line.split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def _forget() -> None:
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return


def attempt(path: Path, drawn: bool = False) -> list[str]:
    """Compile a spec, perhaps lay it out, and show what was found; the codes."""
    try:
        network = nv.compile(path)
        if drawn:
            network.layout()
    except nv.SpecError as error:
        show_text(error.diagnostics, error.sources)
        return [item.code for item in error.diagnostics]
    return []


def measure(path: Path, case: Case, answer: Connection) -> None:
    """Compile a spec, perhaps lay it out, or load a file; to be called once in a process."""
    opened: list[str] = []
    sys.addaudithook(lambda event, given: opened.append(str(given[0])) if event == "open" else None)
    _forget()
    before, begun = _peak(), time.process_time()
    try:
        codes = attempt(path, case.drawn) if case.loaded is None else case.loaded(path)
    except BaseException as error:
        answer.send(f"{type(error).__name__}: {error}"[:100])
        return
    seconds = time.process_time() - begun
    ours = (str(path), "/proc/", sys.prefix, sys.base_prefix)
    answer.send(Result(seconds, _peak() - before, codes, [name for name in opened if not name.startswith(ours)]))


def measured_apart(case: Case) -> Result | str:
    """The same in a process of its own; a text says why there is nothing to say."""
    own = multiprocessing.get_context("fork")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        path = folder / f"spec{case.suffix}"
        path.write_text(case.text, encoding="utf-8", newline="")
        if case.files is not None:
            case.files(folder)
        ours, theirs = own.Pipe(duplex=False)
        process = own.Process(target=measure, args=(path, case, theirs))
        process.start()
        theirs.close()
        try:
            result: Result | str = ours.recv() if ours.poll(LONGEST) else f"longer than {LONGEST} s"
        except EOFError:
            result = "the process died"
        process.kill()
        process.join()
    return result


def judge(case: Case, result: Result) -> tuple[bool, str]:
    """Whether this counts as a failure, and a word."""
    if case.closed and result.opened:
        return True, f"opened {result.opened}"
    if result.seconds > CLEARLY_SLOW * case.seconds or result.mib > CLEARLY_LARGE * case.mib:
        return True, "far beyond"
    return False, "yes" if result.seconds <= case.seconds and result.mib <= case.mib else "beyond"


def main() -> int:
    wanted = sys.argv[1:]
    failures = 0
    with tempfile.TemporaryDirectory() as folder:
        warm = Path(folder) / "warm.yaml"
        warm.write_text(SMALL, encoding="utf-8")
        attempt(warm)
    network().run(1)
    for title, cases in GROUPS.items():
        chosen = {name: case for name, case in cases.items() if not wanted or name in wanted or title in wanted}
        if chosen:
            print(f"\n{title:42}{'time':>10}{'memory':>12}{'budget':>18}  {'kept':12}findings")
        for name, case in chosen.items():
            result = measured_apart(case)
            if isinstance(result, str):
                failures += 1
                print(f"{name:42}    FAILED  {result}", flush=True)
                continue
            failed, word = judge(case, result)
            failures += failed
            codes = sorted(set(result.codes))
            budget = f"{case.seconds:7.1f} s {case.mib:5.0f} MiB"
            found = ", ".join(codes[:4]) + (" …" if len(codes) > 4 else "")
            print(f"{name:42}{result.seconds:8.3f} s{result.mib:8.1f} MiB{budget}  {word:12}{found}", flush=True)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
