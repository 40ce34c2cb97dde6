"""``neurovis docs``: what it says of keys, built-ins, patterns and functions is so, and its examples compile."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import numpy as np
import pytest
import yaml

import neurovis_spec as nv
from neurovis_spec.cli.topics import contents, text_of
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.language.patterns import PATTERNS, Pattern
from neurovis_spec.manual.builtins import builtins
from neurovis_spec.manual.keys import Key, example, examples, keys
from neurovis_spec.manual.networks import Start
from neurovis_spec.manual.topics import find, near, topics
from neurovis_spec.manual.words import functions, names

ROOT = Path(__file__).parents[1]
BASE = {
    "neurovis": "neurovis: 1",
    "name": "name: example",
    "neurons": "neurons: {A: {}, B: {}, O: {}, T: {}, K: {count: 4}}",
}


def completed(part: str) -> str:
    """A whole spec from a part of one."""
    there = yaml.safe_load(part)
    return "\n".join([part, *(line for key, line in BASE.items() if key not in there)])


#: Of a part of a spec one expects no more than that all of it means something.
PARTIAL = {"idle-neuron", "unused-definition", "unused-input", "unused-parameter"}


def codes(network: CompiledNetwork) -> set[str]:
    """The warnings, but for those that a whole spec would not cause."""
    return {finding.code for finding in network.warnings} - PARTIAL


def docs(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "neurovis_spec", "docs", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


# ---- keys --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", examples())
def test_an_example_of_a_key_compiles(path: str, tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    np.savetxt(tmp_path / "data" / "sensed.csv", [[0.5]], delimiter=",")
    (tmp_path / "data" / "spikes.csv").write_text("time,index,t_ms,id\n0.001,1,1,1\n")
    shutil.copy(ROOT / "specs" / "walk" / "hexapod.xml", tmp_path)
    (tmp_path / "library").mkdir()
    (tmp_path / "library" / "legs.yaml").write_text("modules: {leg: {neurons: {K: {bias: 1}}}}", encoding="utf-8")
    (tmp_path / "legs.layout.yaml").write_text("neurovis_layout: 1\npositions: {A: [0, 0]}", encoding="utf-8")
    assert path in {key.path for key in keys()}
    network = nv.compile_text(completed(examples()[path]), folder=tmp_path)
    assert codes(network) == set()
    network.run(3)


@pytest.mark.parametrize("key", keys(), ids=lambda key: key.path)
def test_every_key_is_described_and_most_are_shown(key: Key) -> None:
    assert key.about[:1].isupper() or key.about.startswith(("[", "{", "w[", "γ"))
    assert key.about.endswith((".", "…."))
    assert key.kind
    if key.name in ("description", "license", "neurovis") or key.path.startswith("ros."):
        return
    shown = example(key.path)
    assert shown is not None
    assert f"{key.name}:" in shown


def test_defaults_stand_apart_from_the_meaning() -> None:
    found = {key.path: (key.kind, key.default) for key in keys()}
    assert found["connections.delay"] == ("number or expression or {seconds: …} or {matrix: …}", "1")
    assert found["time.steps"] == ("number or expression", "1000")
    assert found["neurons.activation"] == ("name or {name: {…}}", "identity")
    assert found["neurons.combine"] == ("sum, product, distance, max", "sum")
    assert found["connections.self"] == ("true, false", "false")
    assert not any("(default" in key.about for key in keys())


# ---- built-ins ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("builtin", builtins(), ids=lambda builtin: f"{builtin.kind}-{builtin.name}")
def test_a_builtin_is_shown_as_it_ships_and_compiles_as_ones_own(builtin: object) -> None:
    from neurovis_spec.manual.builtins import Builtin

    assert isinstance(builtin, Builtin)
    shown = text_of((builtin,))
    assert "description:" not in builtin.yaml.replace("description: ", "", builtin.yaml.count("{value:"))
    definition = yaml.safe_load(builtin.yaml)
    assert list(definition) == [builtin.name]
    assert shown.startswith(f"{builtin.name}, ")
    assert all(name in shown for name, _, _ in builtin.parameters)
    spec = completed(builtin.use)
    first = nv.compile_text(spec)
    own = nv.compile({**yaml.safe_load(spec), f"{builtin.kind}s": definition})
    later = builtin.time.startswith("dt") or builtin.name in ("cfc", "spike_source") or builtin.kind == "synapse"
    assert codes(own) == (set() if later else {"replaces-builtin"})
    assert codes(first) == set()
    assert own.hash == first.hash


def test_a_description_of_several_lines_is_whole() -> None:
    (rule,) = find("input_correlation")
    assert "ICO learning: an input that comes before a reflex" in " ".join(text_of((rule,)).split())
    assert "Neural Computation 18:1380-1412" in text_of((rule,))


# ---- patterns, functions, names ----------------------------------------------------------------------------------


def test_every_pattern_and_every_function_is_explained() -> None:
    assert all(
        pattern.about and all(setting.about for setting in pattern.settings.values()) for pattern in PATTERNS.values()
    )
    assert all(word.about.endswith(".") for word in functions())


@pytest.mark.parametrize("pattern", PATTERNS.values(), ids=lambda pattern: pattern.name)
def test_a_pattern_is_written_as_shown(pattern: Pattern) -> None:
    spec = completed(
        "neurons: {K: {count: 6}, L: {count: 6}}\n"
        f"connections: {{K -> L: {{weight: 0.1, pattern: {pattern.use}}}}}\nseed: 1"
    )
    assert len(nv.compile_text(spec).network.connections) > 0


@pytest.mark.parametrize("word", functions(), ids=lambda word: word.name)
def test_a_function_takes_the_arguments_shown(word: object) -> None:
    from neurovis_spec.manual.words import Word

    assert isinstance(word, Word)
    count = word.usage.count(",") + 1
    arguments = ", ".join(["0.5"] * (2 if "…" in word.usage else count))
    nv.compile_text(completed(f'parameters: {{p: "{word.name}({arguments})"}}'))


@pytest.mark.parametrize(
    ("part", "known"),
    [
        ("parameters: {p: %s}", {"pi", "e", "dt"}),
        ("inputs: {s: {expression: %s}}\nneurons: {A: {input: s}}", {"pi", "e", "dt", "k", "t"}),
        ("neurons: {A: {count: 2, bias: %s}}", {"pi", "e", "dt", "i", "n"}),
        ("connections: {K -> O: {weight: %s}}", {"pi", "e", "dt", "i", "j", "n_from", "n_to"}),
        ("activations: {a: {value: %s}}", {"pi", "e", "dt", "x"}),
        ("models: {a: {activity: %s}}", {"pi", "e", "dt", "k", "t", "drive"}),
        ("rules: {a: {weight: {each_step: %s}}}", {"pi", "e", "dt", "k", "t", "pre", "sent", "post", "weight"}),
    ],
)
def test_names_mean_something_where_it_says(part: str, known: set[str]) -> None:
    for word in names():
        if "(" in word.usage or word.name == "f":
            continue
        try:
            nv.compile_text(completed(part % word.name))
        except nv.SpecError:
            understood = False
        else:
            understood = True
        if word.name != "distance":
            assert understood == (word.name in known), word.name


# ---- looking up --------------------------------------------------------------------------------------------------


def test_every_name_in_the_contents_can_be_looked_up() -> None:
    listed = {
        name for line in contents().splitlines() if line.startswith("  ") for name in line.strip(" ,").split(", ")
    }
    assert listed == {name for name in topics() if "." not in name}
    for name in topics():
        assert name.rpartition(".")[2] in text_of(find(name))


@pytest.mark.parametrize(
    ("asked", "name"),
    [
        ("FORCE", "force"),
        ("rls", "force"),
        ("Least Squares", "force"),
        ("kohonen", "kohonen"),
        ("Sanger", "sanger"),
        ("NCP", "policy"),
    ],
)
def test_networks_to_start_from_are_found_by_what_they_are_known_as(asked: str, name: str) -> None:
    (start,) = find(asked)
    assert isinstance(start, Start)
    assert start.spec.startswith(f"neurovis: 1\nname: {name}\n")
    told = text_of((start,))
    assert told.startswith(f"{name}, a network to start from: {start.title}\n")
    assert dedent(told[told.index("  neurovis: 1") :]) == start.spec.rstrip()


def test_a_name_of_two_things_is_explained_twice() -> None:
    text = text_of(find("tanh"))
    assert "tanh, an activation" in text
    assert "tanh(x), a function of expressions" in text
    text = text_of(find("activation"))
    assert "neurons.activation, a key" in text
    assert "activations, a key" in text
    assert "built in: identity, tanh, sigmoid" in text


def test_a_section_lists_its_keys_with_their_defaults() -> None:
    told = text_of(find("time"))
    assert told.startswith("time, a key, mapping")  # before the key of models
    lines = [" ".join(line.split()) for line in told.splitlines()]
    assert "dt number or expression 1 Seconds a step, or a time such as 0.1 ms." in lines


def test_the_nearest_name_is_offered() -> None:
    assert near("izikevich") == "did you mean 'izhikevich'?"
    assert near("connections.dela").startswith("did you mean 'connections.delay'")
    assert near("qqqq") == "'neurovis docs' lists all names"
    assert near("a" * 100_000) == "'neurovis docs' lists all names"


def test_the_command() -> None:
    done = docs("connections.delay")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("connections.delay, a key, number or expression or {seconds: …} or {matrix: …}, by")
    done = docs()
    assert (done.returncode, done.stderr) == (0, "")
    assert "reward_modulated" in done.stdout
    done = docs("oya")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == "error[unknown-name]: there is nothing about 'oya'\nhelp: did you mean 'oja'?\n"
    assert "help: it is the code of a finding: neurovis explain unknown-key\n" in docs("unknown-key").stderr


def test_a_model_says_its_time_its_ports_and_what_it_gives() -> None:
    rows = [line.split() for line in text_of(find("jansen_rit")).splitlines()]
    assert ["time", "seconds"] in rows
    assert ["outputs", "rate"] in rows
    assert ["sent", "rate"] in rows
    assert "  time  milliseconds" in text_of(find("wilson_cowan"))
    assert "  time" not in text_of(find("izhikevich")).partition("as it ships")[0]
