"""Texts that are too much: labels of many characters, mappings of many entries; refused early, or linear in time."""

from __future__ import annotations

import tracemalloc

import pytest
from hypothesis import given
from hypothesis import strategies as st

import neurovis_spec as nv
from neurovis_spec.compiler.names import size_estimate
from neurovis_spec.diagnostics import Findings
from neurovis_spec.language.yaml import brackets, refusals
from neurovis_spec.language.yaml.reader import read_text
from neurovis_spec.scene.texts import Cut, parts_of, width, wrapped

HEAD = "neurovis: 1\nname: x\n"
LONG = "W" * 100_000


def found(text: str) -> list[tuple[str, int, int, str]]:
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(HEAD + text)
    return [(item.code, item.span.line, item.span.column, item.message) for item in caught.value.diagnostics]


# Labels


def test_a_label_is_a_line_of_a_picture() -> None:
    message = "this label has 1,001 characters; 1,000 are the most"
    most, more = "W" * 1000, "W" * 1001
    assert found(f"neurons: {{A: {{label: {more}}}}}\n") == [("label-too-long", 3, 22, message)]
    assert found(f"neurons: {{A: {{count: 2, label: [a, {more}]}}}}\n") == [("label-too-long", 3, 36, message)]
    entry = f"neurons: {{A: {{bias: 1}}, B: {{}}}}\nconnections: {{A -> B: {{label: {more}}}}}\n"
    assert found(entry) == [("label-too-long", 4, 31, message)]
    nv.compile_text(HEAD + f"neurons: {{A: {{label: {most}}}, B: {{}}}}\nconnections: {{A -> B: {{label: {most}}}}}\n")


def test_names_of_any_length_are_cut_in_linear_memory() -> None:
    """The beginnings of one name of 100,000 characters took 5 GB."""
    tracemalloc.start()
    try:
        cut = Cut([LONG, LONG + "1", "V" * 100_000])
        assert cut.shorten(LONG, 10, 40) == "…" + "W" * len(cut.shorten(LONG, 10, 40)[1:])
        assert tracemalloc.get_traced_memory()[1] < 10 << 20
    finally:
        tracemalloc.stop()


@given(
    names=st.lists(st.text("ab ", max_size=6), max_size=8),
    name=st.text("ab ", min_size=1, max_size=6),
    room=st.floats(1, 60),
)
def test_an_end_is_shown_where_two_names_begin_alike(names: list[str], name: str, room: float) -> None:
    """As often as a beginning is that of other names, counted one by one."""
    cut = Cut([*names, name])
    shown = cut.shorten(name, 10, room)
    begins = [one for one in {*names, name} if len(one) > len(shown[:-1]) and one.startswith(shown[:-1])]
    if shown and shown != name and shown.endswith("…") and shown != "…":
        assert len(begins) < 2


@given(text=st.text("aWi\u0301 _-", max_size=40), room=st.floats(0.5, 90), weight=st.sampled_from([400, 600]))
def test_lines_are_those_of_a_text_that_is_measured_letter_by_letter(text: str, room: float, weight: int) -> None:
    """Each line has as many parts, and a part that is wider by itself as many letters, as fit, but at least one."""
    expected = [""]
    for between, part in parts_of(text):
        if width(expected[-1] + between + part, 10, weight) <= room:
            expected[-1] += between + part
            continue
        expected += [""] if expected[-1] else []
        for letter in part:
            begun = expected[-1] + letter
            if expected[-1] and width(begun, 10, weight) > room:
                expected.append(letter)
            else:
                expected[-1] = begun
    assert wrapped(text, 10, room, weight) == expected


@pytest.mark.parametrize(
    "text",
    [
        "title: {0}\nneurons: {{A: {{bias: 1}}, B: {{}}}}\n",
        "neurons: {{A: {{bias: 1, box: {0}, description: {0}}}, B: {{}}}}\n",
        "neurons: {{A: {{bias: 1}}, B: {{}}}}\nrender: {{title: {0}}}\n",
    ],
)
def test_what_else_is_drawn_may_be_long(text: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    target = tmp_path_factory.mktemp("drawn") / "x.svg"
    nv.compile_text(HEAD + text.format(LONG) + "connections: {A -> B: 1}\n").render(target, step=1)
    assert target.stat().st_size < 4 << 20


# Entries


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("".join(f"a{i}: 1\n" for i in range(30)), (21, 1)),
        ("n:\n" + "".join(f"    a{i}: {{}}  # b: c\n" for i in range(30)), (22, 5)),
        ("n:\n" + "".join(f"  'a{i}':\n    b: 1\n    c: 2\n" for i in range(30)), (62, 3)),
        ("n: {" + ", ".join(f"a{i}: 1" for i in range(30)) + "}\n", (1, 155)),
        ("n: {" + ", ".join(f"a{i}: {{b: 1}}" for i in range(30)) + "}\n", (1, 255)),
        ("n:\n" + "".join(f"  - A -> B{i}: 0.1\n" for i in range(30)), (22, 3)),
        ("n:\n" + "".join(f"- {{A -> B{i}: 0.1}}\n" for i in range(30)), (22, 1)),
        ("n:\n" + "".join(f"-\n  'A':\n    b: {i}\n" for i in range(30)), (62, 1)),
        ("n: [" + ", ".join("{b: 1}" for _ in range(30)) + "]\n", (1, 165)),
    ],
)
def test_a_mapping_has_so_many_entries(text: str, place: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(brackets, "MOST_ENTRIES", 20)
    monkeypatch.setattr("neurovis_spec.language.yaml.reader.crowded", lambda text: refusals.crowded(text, 20))
    findings = Findings()
    assert read_text(text, "x", findings) is None
    (item,) = findings.sorted()
    assert (item.code, item.span.line, item.span.column) == ("too-large", *place)


def test_entries_of_several_mappings_are_not_counted_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(brackets, "MOST_ENTRIES", 20)
    many = "".join(f"- a: 1\n  b: 2\n  c: {{d: 1}}\n- {i}\n- {i}\n" for i in range(20))
    for text in (
        "".join(f"a{i}:\n" + "".join(f"  b{k}: 1\n" for k in range(20)) for i in range(20)),
        f"connections:\n{many}",
        "m:\n" + "".join(f"  - [A{i}, B: 1]\n" for i in range(30)),
        "t: |\n" + "".join(f"  a{i}: 1\n" for i in range(20)) + "u: 1\n",
    ):
        assert refusals.crowded(text, 20) is None


@pytest.mark.parametrize(
    ("lines", "column", "message"),
    [
        (
            ["neurons:", *(f" A{i}: {{}}" for i in range(30_000))],
            2,
            "a mapping has at most 1,000,000 entries; this is one more",
        ),
        (
            ["connections:", *(f"- A -> B{i}: 1" for i in range(30_000))],
            1,
            "a list has at most 1,000,000 mappings; this is one more",
        ),
    ],
    ids=["groups", "mappings of a list"],
)
def test_too_many_are_refused_before_memory_is_taken(
    lines: list[str], column: int, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("neurovis_spec.language.yaml.reader.crowded", lambda text: refusals.crowded(text, 20_000))
    text = HEAD + "".join(f"{line}\n" for line in lines)
    findings = Findings()
    tracemalloc.start()
    try:
        assert read_text(text, "x", findings) is None
        assert tracemalloc.get_traced_memory()[1] < 1 << 18
    finally:
        tracemalloc.stop()
    (item,) = findings.sorted()
    assert (item.span.line, item.span.column) == (20_004, column)
    assert item.message == message


# Memory; benchmarks/work.py counts what is done for each of many


@pytest.mark.parametrize(("body", "most"), [("{}", 2_300), ("{activation: tanh, bias: 0.1}", 3_800)])
def test_a_group_takes_little_memory(body: str, most: int) -> None:
    def peak(groups: int) -> int:
        text = HEAD + "neurons:\n" + "".join(f"  A{i}: {body}\n" for i in range(groups))
        tracemalloc.start()
        try:
            assert len(nv.compile_text(text).network.neurons) == groups
            return tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()

    peak(10)
    assert (peak(6_000) - peak(2_000)) / 4_000 < most


def test_too_many_instances_are_told_at_the_first_that_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(size_estimate, "MOST_INSTANCES", 100)
    rows = "".join(f"  i{i}: {{module: m}}\n" for i in range(400))
    text = f"{HEAD}modules: {{m: {{neurons: {{A: {{bias: 1}}}}}}}}\ninstances:\n{rows}"
    with pytest.raises(nv.SpecError) as caught:
        nv.compile_text(text)
    assert [(item.code, item.span.line) for item in caught.value.diagnostics] == [("too-many", 105)]


def test_an_unknown_activation_is_told_in_every_group() -> None:
    rows = "neurons: {A: {activation: tanh}, B: {activation: wrong}, C: {activation: amiss}}\n"
    assert [(code, line, column) for code, line, column, _ in found(rows)] == [
        ("unknown-activation", 3, 50),
        ("unknown-activation", 3, 74),
    ]
