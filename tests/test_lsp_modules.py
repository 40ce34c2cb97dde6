"""Modules, instances and included files in an editor, as plain functions of a text and a place."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import examples
from lsp_marks import marked

from neurovis_spec.lsp.check import check
from neurovis_spec.lsp.completion import complete
from neurovis_spec.lsp.definition import definition
from neurovis_spec.lsp.document import Document
from neurovis_spec.lsp.files import Files
from neurovis_spec.lsp.hover import hover
from neurovis_spec.lsp.rename import Edit, RenameError, apply, prepare, rename
from neurovis_spec.lsp.symbols import symbols
from neurovis_spec.lsp.text import Place

LEGS = """neurovis: 1
include: [knees.yaml]
modules:
  leg:
    title: A leg
    parameters: {gain: 1, slow: {value: 2*gain, description: how slow}}
    neurons: {S: {input: load}, K: {count: 3, activation: soft, description: kernels}}
    inputs: {load: {}}
    instances: {knee: {module: joint, set: {angle: gain}, inputs: {push: load}}}
    connections: {S -> K1..K3: slow, knee.J -> K: {pattern: all_to_all}}
activations:
  soft: {parameters: {slope: 1}, value: tanh(slope * x), description: Soft.}
"""
KNEES = """neurovis: 1
modules:
  joint:
    parameters: {angle: 1}
    inputs: {push: {}}
    neurons: {J: {count: 2, input: push, bias: angle}, S: {bias: 1}}
    connections: {S -> J: 1}
"""
SPEC = """neurovis: 1
name: walker
include: [library/legs.yaml]
parameters: {gain: 3}
inputs: {torque: {expression: sin(k)}}
neurons:
  S: {activation: soft}
  K: {bias: gain}
modules:
  toe: {parameters: {gain: 2}, neurons: {S: {bias: gain}, T: {count: 2}}, connections: {S -> T: 1}}
instances:
  left: {module: leg, count: 3, set: {gain: 0.8*i}, inputs: {load: torque}}
  right: {module: leg}
  foot: {module: toe}
connections:
  left1.K1 + left1.K2..K3 -> K: 1
  left.K -> S: gain
  right.knee.J -> foot.T: {pattern: one_to_one}
  S -> foot.S: 1
outputs: {o: [left2.K1..left2.K2, foot.T1]}
layout: {positions: {left1.K1: [0, 0], right: [3, 3]}, mirror: [[left1, left2]]}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "legs.yaml").write_text(LEGS)
    (tmp_path / "library" / "knees.yaml").write_text(KNEES)
    (tmp_path / "spec.yaml").write_text(SPEC)
    return tmp_path.resolve()


def at(folder: Path, mark: str, text: str = SPEC) -> tuple[Document, Place]:
    """A document of the workspace with the pointer where a part of its text has its mark."""
    document, place = marked(text.replace(mark.replace("¦", ""), mark, 1), folder)
    return replace(document, files=Files(roots=(folder,))), place


def library(folder: Path, name: str, mark: str) -> tuple[Document, Place]:
    """The same for an included file."""
    path = folder / "library" / name
    text = path.read_text()
    document, place = marked(text.replace(mark.replace("¦", ""), mark, 1), path.parent)
    return replace(document, file=str(path), files=Files({folder / "spec.yaml": SPEC}, (folder,))), place


def offered(document: Document, place: Place) -> set[str]:
    return {item.label for item in complete(document, place)}


def test_the_texts_of_these_tests_are_sound(folder: Path) -> None:
    checked = check(Document(SPEC, "spec.yaml", folder))
    assert [str(item) for item in checked.findings if item.severity == "error"] == []
    assert checked.files == {folder / "library" / "legs.yaml", folder / "library" / "knees.yaml"}
    for name in ("legs.yaml", "knees.yaml"):
        document, _ = library(folder, name, "¦")
        assert check(document).findings == ()


# ---- completion --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mark", "there", "missing"),
    [
        ("{module: ¦leg, count", ["leg", "toe", "joint"], ["left", "tanh"]),
        ("right: {¦module: leg}", ["set", "inputs", "count"], ["first", "neurons"]),
        ("set: {¦gain: 0.8", ["gain", "slow"], ["torque", "angle"]),
        ("0.8*¦i}", ["gain", "i", "n"], ["slow", "angle", "K"]),
        ("inputs: {¦load: torque", ["load"], ["torque", "push"]),
        ("load: ¦torque", ["torque"], ["load", "K", "gain"]),
        ("  left1.¦K1 +", ["S", "K", "K1", "K3", "knee"], ["left", "T", "torque", "J"]),
        ("left1.K2..¦K3", ["K3"], ["K1", "K2", "S", "left"]),
        ("  right.knee.¦J ->", ["J", "J1", "J2", "S"], ["K", "knee", "T"]),
        ("  ¦left.K ->", ["left", "left1", "left3", "right", "S", "K"], ["T", "left4", "J"]),
        ("left2.K1..¦left2", ["K2", "K3"], ["K1", "left1"]),
        ("left2.K1..left2.¦K2", ["K2", "K3", "S"], ["left1", "T"]),
        ("positions: {left1.¦K1", ["K1", "S"], ["K"]),
        ("positions: {¦left1", ["left1", "right", "S"], ["T"]),
        ("{bias: ¦gain}, T", ["gain", "i"], ["slow"]),
        ("connections: {¦S -> T", ["S", "T", "T2"], ["K", "left", "torque"]),
        ("{activation: ¦soft", ["soft", "tanh"], []),
    ],
)
def test_what_is_offered_in_a_spec(folder: Path, mark: str, there: list[str], missing: list[str]) -> None:
    found = offered(*at(folder, mark))
    assert [name for name in there if name not in found] == []
    assert [name for name in missing if name in found] == []


@pytest.mark.parametrize(
    ("mark", "there", "missing"),
    [
        ("{S: {input: ¦load", ["load"], ["torque", "push"]),
        ("{value: ¦2*gain", ["gain"], ["slow", "angle"]),
        ("{¦S -> K1", ["S", "K", "K1", "knee"], ["left", "J", "T"]),
        ("knee.¦J", ["J", "J2", "S"], ["K"]),
        ("{module: ¦joint", ["joint", "leg", "toe"], []),
        ("set: {¦angle", ["angle"], ["gain"]),
        ("inputs: {¦push", ["push"], ["load"]),
        ("push: ¦load", ["load"], ["push", "torque"]),
        ("activation: ¦soft", ["soft", "relu"], []),
        ("¦neurovis: 1", ["neurovis", "models", "license"], ["name", "neurons", "instances", "layout"]),
    ],
)
def test_what_is_offered_in_an_included_file(folder: Path, mark: str, there: list[str], missing: list[str]) -> None:
    found = offered(*library(folder, "legs.yaml", mark))
    assert [name for name in there if name not in found] == []
    assert [name for name in missing if name in found] == []


def test_inputs_of_instances_that_come_from_outside_are_offered(folder: Path) -> None:
    text = SPEC.replace("  K: {bias: gain}", "  K: {bias: gain, input: }")
    assert "right.load" in offered(*at(folder, "gain, input: ¦}", text))
    text = SPEC.replace(", inputs: {load: torque}", "") + "ros: {subscribe: {"
    found = offered(*at(folder, "subscribe: {¦", text))
    assert {"left1.load", "left3.load", "right.load", "torque"} <= found
    assert {"load", "foot.load", "left4.load"}.isdisjoint(found)


def test_completion_goes_by_the_file_as_it_is_open_in_the_editor(folder: Path) -> None:
    document, place = at(folder, "  left1.¦K1 +")
    changed = LEGS.replace("{S: {input: load}", "{Shin: {input: load}")
    document = replace(document, files=Files({folder / "library" / "legs.yaml": changed}, (folder,)))
    assert {"Shin", "K", "knee"} <= offered(document, place) - {"S"}


def test_a_file_that_changes_on_disk_is_read_anew(folder: Path) -> None:
    document, place = at(folder, "  left1.¦K1 +")
    assert "S" in offered(document, place)
    path = folder / "library" / "legs.yaml"
    assert document.files.unchanged(document.reach)
    path.write_text(LEGS.replace("{S: {input", "{Thigh: {input"))
    assert not document.files.unchanged(document.reach)
    assert "Thigh" in offered(replace(document), place)


# ---- hover and definition ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mark", "told"),
    [
        (
            "  left1.K¦1 +",
            ["**left1.K1**, a neuron of **K**: 3 neurons", "module `leg` (in legs.yaml)", "soft", "kernels"],
        ),
        ("  left.K¦ -> S", ["**left.K**: 3 neurons", "module `leg`"]),
        ("right.knee.J¦ ->", ["**right.knee.J**: 2 neurons", "module `joint` (in knees.yaml)"]),
        ("  le¦ft.K", ["**left** (3 of them): instance of the module `leg`"]),
        ("right.kne¦e", ["**right.knee**: instance of the module `joint`"]),
        ("foot.T¦:", ["**foot.T**: 2 neurons (T1 … T2) of the module `toe`\n"]),
        ("set: {gai¦n", ["**gain** = `1` of the module `leg`"]),
        ("inputs: {loa¦d", ["**load** (input): from outside of the module `leg`"]),
        ("load: torq¦ue", ["**torque** (input): `sin(k)`"]),
        ("module: le¦g", ["**leg** (module) (in legs.yaml): A leg", "parameter `slow` = `2*gain`", "input `load`"]),
        ("activation: so¦ft", ["f(x) = tanh(slope * x)", "Soft."]),
        ("S: gai¦n", ["**gain** = `3`"]),
        ("{S: {bias: gai¦n", ["**gain** = `2` of the module `toe`"]),
    ],
)
def test_what_hover_tells(folder: Path, mark: str, told: list[str]) -> None:
    found = hover(*at(folder, mark))
    assert found is not None
    assert [part for part in told if part not in found.markdown] == []


def test_the_size_of_a_group_of_a_module_is_that_of_the_network(folder: Path) -> None:
    text = SPEC.replace("T: {count: 2}", "T: {count: gain}")
    text = text.replace("right.knee.J -> foot.T: {pattern: one_to_one}", "right.knee.J1 -> foot.T1 + foot.T2: 1")
    for mark, told in (("foot.T¦1]", "2 neurons (T1 … T2)"), ("left.K¦ ->", "3 neurons (K1 … K3)")):
        document, place = at(folder, mark, text)
        checked = check(document)
        assert checked.network is not None, checked.findings
        found = hover(replace(document, network=checked.network), place)
        assert found is not None
        assert told in found.markdown


@pytest.mark.parametrize(
    ("mark", "file", "line", "name"),
    [
        ("  left1.K¦1 +", "legs.yaml", 7, "K"),
        ("K2..K¦3 ->", "legs.yaml", 7, "K"),
        ("left2.K1..left2.K¦2", "legs.yaml", 7, "K"),
        ("  left.K¦ -> S", "legs.yaml", 7, "K"),
        ("right.kne¦e", "legs.yaml", 9, "knee"),
        ("right.knee.J¦", "knees.yaml", 6, "J"),
        ("  le¦ft.K ->", None, 12, "left"),
        ("[[left1, lef¦t2", None, 12, "left"),
        ("foot.T¦1", None, 10, "T"),
        ("S -> foot.S¦", None, 10, "S"),
        ("  S¦ -> foot", None, 7, "S"),
        ("module: to¦e", None, 10, "toe"),
        ("module: le¦g", "legs.yaml", 4, "leg"),
        ("set: {gai¦n", "legs.yaml", 6, "gain"),
        ("inputs: {loa¦d", "legs.yaml", 8, "load"),
        ("load: torqu¦e", None, 5, "torque"),
        ("activation: so¦ft", "legs.yaml", 12, "soft"),
        ("{bias: gai¦n}, T", None, 10, "gain"),
        ("S: gai¦n", None, 4, "gain"),
    ],
)
def test_where_a_definition_is(folder: Path, mark: str, file: str | None, line: int, name: str) -> None:
    document, place = at(folder, mark)
    found = definition(document, place)
    assert found is not None
    page = document.page
    if file is None:
        assert found.path is None
    else:
        assert found.path == folder / "library" / file
        page = document.page_of(str(found.path))
    assert (found.span.line, page.text.part(found.span)) == (line, name)


def test_a_definition_of_the_spec_is_found_from_the_file_that_it_includes(folder: Path) -> None:
    document, place = library(folder, "knees.yaml", "{J¦: {count: 2, input")
    text = document.source.replace("bias: angle", "bias: angle, activation: soft")
    document = replace(document, source=text)
    spot = Place(6, text.splitlines()[5].index("soft") + 2)
    found = definition(document, spot)
    assert found is not None
    assert found.path == folder / "library" / "legs.yaml"
    assert definition(document, place) is not None


def test_an_included_path_leads_to_the_file(folder: Path) -> None:
    found = definition(*at(folder, "[library/le¦gs"))
    assert found is not None
    assert (found.path, found.span.line) == (folder / "library" / "legs.yaml", 1)
    assert definition(*at(folder, "[../library/le¦gs", SPEC.replace("[lib", "[../lib"))) is None


# ---- rename --------------------------------------------------------------------------------------------------------


def renamed(document: Document, place: Place, new: str) -> dict[str, str]:
    """The texts that a rename changes, by the names of their files."""
    return {path.name: text for path, text in renamed_texts(document, rename(document, place, new)).items()}


def renamed_texts(document: Document, edits: tuple[Edit, ...]) -> dict[Path, str]:
    """The texts that edits change."""
    result = {}
    for file in {edit.span.file for edit in edits}:
        page = document.page if file == document.file else document.files.page(Path(file))
        assert page is not None
        result[Path(file)] = apply(Document(page.source, file), edits).source
    return result


def test_a_group_of_a_module_is_renamed_in_all_dotted_references(folder: Path) -> None:
    for mark in ("  left1.K¦1 +", "left2.K1..left2.K¦2", "{left1.K¦1: [0", "  left.K¦ -> S"):
        assert renamed(*at(folder, mark), "Kernel") == {
            "spec.yaml": SPEC.replace("left1.K1 + left1.K2..K3", "left1.Kernel1 + left1.Kernel2..Kernel3")
            .replace("left.K ->", "left.Kernel ->")
            .replace("left2.K1..left2.K2", "left2.Kernel1..left2.Kernel2")
            .replace("{left1.K1:", "{left1.Kernel1:"),
            "legs.yaml": LEGS.replace("K: {count", "Kernel: {count")
            .replace("K1..K3", "Kernel1..Kernel3")
            .replace("-> K: {p", "-> Kernel: {p"),
        }


def test_a_name_of_the_spec_leaves_those_of_modules_alone(folder: Path) -> None:
    assert renamed(*at(folder, "  S¦: {act"), "Sum") == {
        "spec.yaml": SPEC.replace("  S: {act", "  Sum: {act")
        .replace("left.K -> S", "left.K -> Sum")
        .replace("  S -> foot.S", "  Sum -> foot.S")
    }
    assert renamed(*at(folder, "S: gai¦n"), "g") == {
        "spec.yaml": SPEC.replace("parameters: {gain: 3}", "parameters: {g: 3}")
        .replace("  K: {bias: gain}", "  K: {bias: g}")
        .replace("S: gain", "S: g")
    }
    assert renamed(*at(folder, "{S¦: {bias: gain}, T"), "Sole") == {
        "spec.yaml": SPEC.replace("{S: {bias: gain}, T", "{Sole: {bias: gain}, T")
        .replace("{S -> T", "{Sole -> T")
        .replace("foot.S", "foot.Sole")
    }


def test_parameters_inputs_instances_and_modules_are_renamed_across_files(folder: Path) -> None:
    assert renamed(*at(folder, "set: {gai¦n"), "force") == {
        "spec.yaml": SPEC.replace("set: {gain", "set: {force"),
        "legs.yaml": LEGS.replace("gain", "force"),
    }
    assert renamed(*at(folder, "inputs: {loa¦d"), "weight_on") == {
        "spec.yaml": SPEC.replace("load", "weight_on"),
        "legs.yaml": LEGS.replace("load", "weight_on"),
    }
    assert renamed(*at(folder, "right.kne¦e"), "hinge") == {
        "spec.yaml": SPEC.replace("knee", "hinge"),
        "legs.yaml": LEGS.replace("knee:", "hinge:").replace("knee.J", "hinge.J"),
    }
    assert renamed(*at(folder, "module: le¦g"), "limb") == {
        "spec.yaml": SPEC.replace("module: leg", "module: limb"),
        "legs.yaml": LEGS.replace("  leg:", "  limb:"),
    }
    assert renamed(*at(folder, "activation: so¦ft"), "mild") == {
        "spec.yaml": SPEC.replace("soft", "mild"),
        "legs.yaml": LEGS.replace("soft", "mild"),
    }
    assert renamed(*at(folder, "  le¦ft.K"), "near") == {"spec.yaml": SPEC.replace("left", "near")}


def test_from_an_included_file_all_specs_of_the_workspace_are_renamed(folder: Path) -> None:
    other = (
        "neurovis: 1\nname: other\ninclude: library/knees.yaml\ninstances: {a: {module: joint}}\noutputs: {o: a.J1}\n"
    )
    (folder / "other.yaml").write_text(other)
    (folder / ".hidden").mkdir()
    (folder / ".hidden" / "spec.yaml").write_text(other.replace("library", "../library"))
    assert renamed(*library(folder, "knees.yaml", "{J¦: {count"), "Joint") == {
        "knees.yaml": KNEES.replace("J:", "Joint:"),
        "legs.yaml": LEGS.replace("knee.J", "knee.Joint"),
        "spec.yaml": SPEC.replace("knee.J", "knee.Joint"),
        "other.yaml": other.replace("a.J1", "a.Joint1"),
    }


@pytest.mark.parametrize(
    ("mark", "new", "why"),
    [
        ("  left1.K¦1 +", "S", "'S' is declared already, in line 7 of legs.yaml"),
        ("  left1.K¦1 +", "load", "'load' is declared already, in line 8 of legs.yaml"),
        ("module: le¦g", "toe", "'toe' is declared already, in line 10"),
        ("module: to¦e", "joint", "'joint' is declared already, in line 3 of knees.yaml"),
        ("set: {gai¦n", "pi", "may not be called 'pi'"),
        ("set: {gai¦n", "i", "may not be called 'i'"),
        ("set: {gai¦n", "n_to", "'n_to' means something else in line 10 of legs.yaml"),
        ("set: {gai¦n", "slow", "'slow' is declared already, in line 6 of legs.yaml"),
        ("  le¦ft.K", "K", "'K' is declared already, in line 8"),
    ],
)
def test_a_bad_rename_is_refused(folder: Path, mark: str, new: str, why: str) -> None:
    text = LEGS.replace("K1..K3: slow", "K1..K3: gain")
    (folder / "library" / "legs.yaml").write_text(text)
    with pytest.raises(RenameError) as caught:
        rename(*at(folder, mark), new)
    assert why in str(caught.value)


def test_what_lies_beyond_the_workspace_is_not_renamed(folder: Path) -> None:
    document, place = at(folder, "  left1.K¦1 +")
    with pytest.raises(RenameError, match=r"'legs\.yaml', which has this name too, is not in the workspace"):
        rename(replace(document, files=Files()), place, "Kernel")
    opened = Files({folder / "library" / "legs.yaml": LEGS})
    assert set(renamed(replace(document, files=opened), place, "Kernel")) == {"spec.yaml", "legs.yaml"}


def test_what_ships_is_not_renamed(folder: Path) -> None:
    document, place = at(folder, "activation: ta¦nh", SPEC.replace("soft}", "tanh}"))
    with pytest.raises(RenameError, match="not declared in this document"):
        prepare(document, place)


# ---- checks --------------------------------------------------------------------------------------------------------


def test_an_included_file_is_checked_with_one_instance_of_each_module(folder: Path) -> None:
    document, _ = library(folder, "legs.yaml", "¦")
    broken = LEGS.replace("S -> K1..K3", "S -> K1..K4").replace("activation: soft", "activation: sofd")
    found = check(replace(document, source=broken)).findings
    assert [(item.code, item.span.line, item.span.file) for item in found] == [
        ("unknown-activation", 7, document.file),
        ("bad-range", 10, document.file),
    ]
    found = check(replace(document, source="neurovis: 1\nmodules: {a: {neurons: {A: {}, A: {}}}, b: 1}\n")).findings
    assert {item.code for item in found} == {"duplicate-key", "wrong-type"}
    assert check(Document("neurovis: 1\nparameters: {a: 1}\n")).findings[0].code == "missing-key"


def test_included_files_that_include_each_other_are_looked_at_once(folder: Path) -> None:
    (folder / "library" / "knees.yaml").write_text("include: [legs.yaml, knees.yaml]\n" + KNEES)
    document, place = at(folder, "  left1.¦K1 +")
    assert {"S", "knee"} <= offered(document, place)
    assert {Path(page.file).name for page in document.reach} == {"legs.yaml", "knees.yaml"}
    assert {item.code for item in check(document).findings} == {"include-cycle"}


def test_what_cannot_be_read_is_passed_over(folder: Path) -> None:
    (folder / "library" / "knees.yaml").unlink()
    (folder / "library" / "knees.yaml").mkdir()
    document, place = at(folder, "  right.knee.¦J ->")
    assert offered(document, place) == set()
    assert hover(*at(folder, "right.knee.J¦ ->")) is None
    (folder / "library" / "legs.yaml").write_bytes(b"modules: {leg: {neurons: {S: {}, \xff")
    assert "S" in offered(*at(folder, "  left1.¦K1 +"))


# ---- whatever somebody is typing -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def somewhere(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("work").resolve()
    (folder / "library").mkdir()
    (folder / "library" / "legs.yaml").write_text(LEGS)
    (folder / "library" / "knees.yaml").write_text(KNEES)
    (folder / "spec.yaml").write_text(SPEC)
    return folder


@examples(40)
@given(st.data())
def test_nothing_breaks_on_whatever_somebody_is_typing(somewhere: Path, data: st.DataObject) -> None:
    name = data.draw(st.sampled_from(["spec.yaml", "library/legs.yaml", "library/knees.yaml"]))
    path = somewhere / name
    whole = path.read_text(encoding="utf-8")
    at = data.draw(st.integers(0, len(whole)))
    cut = data.draw(st.integers(at, min(len(whole), at + 60)))
    typed = data.draw(st.text(st.sampled_from("aK1.,:+->{}[]\"'#| \n\t"), max_size=6))
    source = whole[:at] + typed + whole[cut:]
    document = Document(source, str(path), path.parent, files=Files({path: source}, (somewhere,)))
    for place in (Place(*document.text.lines.place(at)), Place(*document.text.lines.place(at + len(typed)))):
        for completion in complete(document, place):
            assert completion.span.line == place.line
            assert completion.span.column <= place.column <= completion.span.end_column
        found = hover(document, place)
        assert found is None or found.markdown
        leads = definition(document, place)
        assert leads is None or leads.path is None or leads.path.is_file()
        with suppress(RenameError):
            span, old = prepare(document, place)
            assert old.startswith(document.text.part(span)[: len(old)])
    symbols(document)
    check(document)


@examples(5)
@given(st.data())
def test_a_rename_there_and_back_changes_nothing(somewhere: Path, data: st.DataObject) -> None:
    """Whatever is renamed, wherever it is named: what is said stays, and the way back leads to the very same texts."""
    texts = {somewhere / name: (somewhere / name).read_text() for name in ("spec.yaml", "library/legs.yaml")}
    path = data.draw(st.sampled_from(sorted(texts)))
    at = data.draw(st.integers(0, len(texts[path])))
    document = Document(texts[path], str(path), path.parent, files=Files(texts, (somewhere,)))
    place = Place(*document.text.lines.place(at))
    try:
        span, old = prepare(document, place)
        edits = rename(document, place, "Zebra")
    except RenameError:
        return
    after = renamed_texts(document, edits)
    assert after != {}
    changed = Files({**texts, **after}, (somewhere,))
    again = Document(after.get(path, texts[path]), str(path), path.parent, files=changed)
    main = somewhere / "spec.yaml"
    found = check(Document(changed.open[main], str(main), somewhere, files=changed)).findings
    assert [item for item in found if item.severity == "error"] == []
    before = [edit for edit in edits if (edit.span.file, edit.span.line) == (document.file, span.line)]
    moved = sum(len("Zebra") - len(old) for edit in before if edit.span.column < span.column)
    back = rename(again, Place(span.line, span.column + moved + 1), old)
    assert {**texts, **after, **renamed_texts(again, back)} == {**texts, **{p: p.read_text() for p in after}}
