"""What Python hands over: each wrong argument of a public function is named, at once."""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

import neurovis_spec as nv
from neurovis_spec import plain
from neurovis_spec.runtime.recording import Recording

TEXT = """neurovis: 1
name: x
parameters: {g: 1}
inputs: {s: {size: 2}}
neurons: {A: {bias: g}, B: {count: 2, input: s}}
connections: {A -> B: {weight: 1, plasticity: hebbian}}
"""
NETWORK = nv.compile_text(TEXT)
RECORDING = NETWORK.run(3)
SPEC = {"neurovis": 1, "name": "x", "neurons": {"A": {}}}
WRONG: dict[str, tuple[object, ...]] = {
    "a text": (None, 5, b"x", ["x"], np.array("x")),
    "a path": (None, 5, b"x", ["x"], ("x",)),
    "an integer": (1.5, float("nan"), "1", None, True, [1], np.array([1, 2]), np.float64(2)),
    "a number": ("1", b"1", None, True, np.True_, [1.0], 1j, np.array([1, 2])),
    "True or False": ("no", 0, None, np.array([True])),
    "a mapping": (5, "s", [("s", 1)], np.zeros(3)),
    "a recording": (5, "x.npz", {}, np.zeros(3)),
    "a layout": (5, "x.yaml", {}),
    "a function": (5, "f", {}),
    "a text or several": (5, None, 1.5),
    "a text or an Until": (5, b"x", ["x"]),
    "a text, several, or a mapping": (5, None, 1.5),
    "a range or numbers": (5, None, 1.5),
    "a view, {view: references}, or several": (5, 1.5, True),
    "a pair": (5, "800x600", True),
}
#: what may be left out: None stands for the default
OPTIONAL = {
    "limit",
    "root",
    "steps",
    "step",
    "fps",
    "engine",
    "effort",
    "theme",
    "backend",
    "scheduler",
    "window",
    "dpi",
    "focus",
}
OPTIONAL |= {"paths", "min_weight", "every", "frames", "size"}
OVER = {"seed": [1]}
CALLS: dict[tuple[str, str, str], Callable[..., object]] = {
    ("compile", "source", "a path"): lambda v: nv.compile(v),
    ("compile", "root", "a path"): lambda v: nv.compile(SPEC, root=v),
    ("compile", "seed", "an integer"): lambda v: nv.compile(SPEC, seed=v),
    ("compile", "limit", "an integer"): lambda v: nv.compile(SPEC, limit=v),
    ("compile_text", "text", "a text"): lambda v: nv.compile_text(v),
    ("compile_text", "file", "a text"): lambda v: nv.compile_text(TEXT, file=v),
    ("compile_text", "parameters", "a mapping"): lambda v: nv.compile_text(TEXT, parameters=v),
    ("compile_text", "g", "a number"): lambda v: nv.compile_text(TEXT, g=v),
    ("load", "path", "a path"): lambda v: nv.load(v),
    ("run", "steps", "an integer"): lambda v: NETWORK.run(v),
    ("run", "every", "an integer"): lambda v: NETWORK.run(3, every=v),
    ("run", "inputs", "a mapping"): lambda v: NETWORK.run(3, v),
    ("run", "backend", "a text"): lambda v: NETWORK.run(3, backend=v),
    ("run", "start", "a recording"): lambda v: NETWORK.run(3, start=v),
    ("run", "progress", "a function"): lambda v: NETWORK.run(3, progress=v),
    ("run_to", "path", "a path"): lambda v: NETWORK.run_to(v, 3),
    ("simulator", "backend", "a text"): lambda v: NETWORK.simulator(v),
    ("simulator", "start", "a recording"): lambda v: NETWORK.simulator(start=v),
    ("learning", "on", "True or False"): lambda v: NETWORK.simulator().learning("A -> B", v),
    ("layout", "engine", "a text"): lambda v: NETWORK.layout(v),
    ("layout", "effort", "a text"): lambda v: NETWORK.layout(effort=v),
    ("layout", "earlier", "a layout"): lambda v: NETWORK.layout(earlier=v),
    ("render", "path", "a path"): lambda v: NETWORK.render(v, step=1),
    ("render", "step", "an integer"): lambda v: NETWORK.render("x.svg", step=v),
    ("render", "recording", "a recording"): lambda v: NETWORK.render("x.svg", recording=v),
    ("render", "theme", "a text"): lambda v: NETWORK.render("x.svg", theme=v),
    ("render", "inputs", "a mapping"): lambda v: NETWORK.render("x.svg", inputs=v),
    ("animate", "engine", "a text"): lambda v: NETWORK.animate("x.svg", engine=v),
    ("render", "view", "a view, {view: references}, or several"): lambda v: NETWORK.render("x.svg", view=v),
    ("render", "window", "an integer"): lambda v: NETWORK.render("x.svg", window=v),
    ("animate", "view", "a view, {view: references}, or several"): lambda v: NETWORK.animate("x.svg", view=v),
    ("animate", "start", "an integer"): lambda v: NETWORK.animate("x.svg", start=v),
    ("animate", "steps", "an integer"): lambda v: NETWORK.animate("x.svg", steps=v),
    ("animate", "fps", "a number"): lambda v: NETWORK.animate("x.svg", fps=v),
    ("render", "dpi", "a number"): lambda v: NETWORK.render("x.png", dpi=v),
    ("render", "collapse", "a text or several"): lambda v: NETWORK.render("x.svg", collapse=v),
    ("render", "focus", "a text"): lambda v: NETWORK.render("x.svg", focus=v),
    ("render", "paths", "a text"): lambda v: NETWORK.render("x.svg", paths=v),
    ("render", "min_weight", "a number"): lambda v: NETWORK.render("x.svg", min_weight=v),
    ("render", "size", "a pair"): lambda v: NETWORK.render("x.svg", size=v),
    ("render", "full", "True or False"): lambda v: NETWORK.render("x.svg", full=v),
    ("animate", "every", "an integer"): lambda v: NETWORK.animate("x.svg", every=v),
    ("animate", "frames", "an integer"): lambda v: NETWORK.animate("x.svg", frames=v),
    ("animate", "collapse", "a text or several"): lambda v: NETWORK.animate("x.svg", collapse=v),
    ("animate", "full", "True or False"): lambda v: NETWORK.animate("x.svg", full=v),
    ("recording", "name", "a text"): lambda v: RECORDING[v],
    ("weight", "name", "a text"): lambda v: RECORDING.weight(v),
    ("snapshot", "step", "an integer"): lambda v: RECORDING.snapshot(v),
    ("save", "path", "a path"): lambda v: RECORDING.save(v),
    ("run", "states", "a text or several"): lambda v: NETWORK.run(3, states=v),
    ("run", "neurons", "a text or several"): lambda v: NETWORK.run_to("x.npz", 3, neurons=v),
    ("run", "until", "a text or an Until"): lambda v: NETWORK.run(3, until=v),
    ("until", "text", "a text"): lambda v: NETWORK.until(v),
    ("measure", "text", "a text"): lambda v: NETWORK.measure(v, RECORDING),
    ("measure", "recording", "a recording"): lambda v: NETWORK.measure("A", v),
    ("save_state", "path", "a path"): lambda v: NETWORK.simulator().save_state(v),
    ("export", "folder", "a path"): lambda v: NETWORK.export(v),
    ("export", "start", "a recording"): lambda v: NETWORK.export("x", start=v),
    ("sweep", "source", "a path"): lambda v: nv.sweep(v, OVER, "A"),
    ("sweep", "over", "a mapping"): lambda v: nv.sweep(SPEC, v, "A"),
    ("sweep", "steps", "an integer"): lambda v: nv.sweep(SPEC, OVER, "A", steps=v),
    ("sweep", "inputs", "a mapping"): lambda v: nv.sweep(SPEC, OVER, "A", inputs=v),
    ("sweep", "parameters", "a mapping"): lambda v: nv.sweep(SPEC, OVER, "A", parameters=v),
    ("sweep", "backend", "a text"): lambda v: nv.sweep(SPEC, OVER, "A", backend=v),
    ("sweep", "jobs", "an integer"): lambda v: nv.sweep(SPEC, OVER, "A", jobs=v),
    ("sweep", "scheduler", "a text"): lambda v: nv.sweep(SPEC, OVER, "A", scheduler=v),
    ("sweep", "path", "a path"): lambda v: nv.sweep(SPEC, OVER, "A", path=v),
    ("sweep", "root", "a path"): lambda v: nv.sweep(SPEC, OVER, "A", root=v),
    ("sweep", "limit", "an integer"): lambda v: nv.sweep(SPEC, OVER, "A", limit=v),
    ("sweep", "progress", "a function"): lambda v: nv.sweep(SPEC, OVER, "A", progress=v),
    ("sweep", "m", "a text"): lambda v: nv.sweep(SPEC, OVER, {"m": v}),
    ("sweep", "metrics", "a text, several, or a mapping"): lambda v: nv.sweep(SPEC, OVER, v),
    ("sweep", "seed", "a range or numbers"): lambda v: nv.sweep(SPEC, {"seed": v}, "A"),
}


@pytest.mark.parametrize(("call", "name", "what"), CALLS)
def test_a_wrong_type_is_named(
    call: str, name: str, what: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for value in WRONG[what]:
        if value is None and (name in OPTIONAL or (call, name) in {("compile", "seed"), ("sweep", "path")}):
            continue
        with pytest.raises(TypeError, match=f"^'{name}' is {what}, not {type(value).__name__}$"):
            CALLS[call, name, what](value)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: nv.compile_text(TEXT, limit=-5), "'limit' is at least 0, not -5"),
        (lambda: nv.compile_text(TEXT, seed=2**80), r"'seed' is at most 9223372036854775807, not about 2\^80"),
        (lambda: nv.compile_text(TEXT, seed=-(2**63) - 1), "'seed' is at least -9223372036854775808"),
        (lambda: nv.compile_text(TEXT, g=10**400), "'g' is beyond what a double can hold"),
        (lambda: nv.compile("a\0b"), "'source' holds a NUL character"),
        (lambda: nv.sweep(SPEC, OVER, "A", steps=-1), "'steps' is at least 1, not -1"),
        (lambda: nv.sweep(SPEC, OVER, "A", jobs=0), "'jobs' is at least 1, not 0"),
        (lambda: nv.sweep(SPEC, OVER, "A", path="a\0b"), "'path' holds a NUL character"),
        (lambda: NETWORK.run(-1), "'steps' is at least 0, not -1"),
        (lambda: NETWORK.run(2**80), "'steps' is at most 9007199254740992"),
        (lambda: NETWORK.run_to("x.npz", 3, every=2**80), "'every' is at most 9007199254740992"),
        (lambda: NETWORK.run(3, every=0), "'every' is at least 1, not 0"),
        (lambda: NETWORK.simulator().set(g=2**2000), "'g' takes a finite number, not 1148"),
        (lambda: NETWORK.simulator().set({"g": True}), "'g' takes a finite number, not True"),
        (lambda: NETWORK.simulator().clamp("A", 2**2000), "clamped to a finite number, not 1148"),
        (lambda: RECORDING.snapshot(2**80), "is not in the recording"),
    ],
)
def test_a_wrong_value_is_named(call: Callable[[], object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        call()


def test_a_mapping_that_is_no_spec_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    loop: dict[str, object] = {"neurovis": 1}
    loop["neurons"] = {"A": {"bias": [loop]}}
    with pytest.raises(ValueError, match=r"holds itself, at 'neurons: A: bias'"):
        nv.compile(loop)
    deep: dict[str, object] = {}
    inner = deep
    for _ in range(100_000):
        inner["a"] = inner = {}
    with pytest.raises(ValueError, match="nested too deeply"):
        nv.compile(deep)
    with pytest.raises(ValueError, match="two keys of the mapping read as '1'"):
        nv.compile({**SPEC, "neurons": {"1": {}, 1: {}}})
    with pytest.raises(TypeError, match="numbers, not bytes"):
        nv.compile({**SPEC, "title": b"x"})
    monkeypatch.setattr(plain, "MOST_VALUES", 1000)
    with pytest.raises(ValueError, match="too large for a spec: it has more than 1,000 values"):
        nv.compile({**SPEC, "neurons": itertools.count()})
    shared: object = 1
    for _ in range(64):  # 2 to the power of 64 values, if they were written one by one
        shared = [shared, shared]
    with pytest.raises(ValueError, match="too large for a spec"):
        nv.compile({**SPEC, "neurons": shared})


@pytest.mark.parametrize("value", [b"x", [5], [None]])
def test_what_is_no_text_among_several_is_named(value: object) -> None:
    calls: dict[str, Callable[..., object]] = {
        "states": lambda: NETWORK.run(3, states=value),  # type: ignore[arg-type]
        "neurons": lambda: NETWORK.run(3, neurons=value),  # type: ignore[arg-type]
        "collapse": lambda: NETWORK.render("x.svg", collapse=value),  # type: ignore[arg-type]
        "metrics": lambda: nv.sweep(SPEC, OVER, value),  # type: ignore[arg-type]
    }
    for name, call in calls.items():
        with pytest.raises(TypeError, match=f"^'{name}' is a text, not (int|NoneType)$"):
            call()


def test_numbers_of_any_make_are_taken() -> None:
    compile_text: Callable[..., nv.CompiledNetwork] = nv.compile_text
    made = compile_text(TEXT, seed=np.int64(3), limit=np.uint8(9), parameters={"g": np.float32(2)})
    run: Callable[..., Recording] = made.run
    assert made.parameters["g"] == 2
    assert len(run(np.int64(3), every=np.int32(2))) == 2


RUN = ("backend", "every", "start", "until", "progress", "states", "neurons", "weights", "signals", "checkpoint")
PICTURE = (
    "recording",
    "inputs",
    "theme",
    "engine",
    "view",
    "progress",
    "collapse",
    "focus",
    "paths",
    "min_weight",
    "size",
)


@pytest.mark.parametrize(
    ("function", "named"),
    [
        (nv.CompiledNetwork.run, {"steps": None, "inputs": None, **dict.fromkeys(RUN), "last": False, "body": True}),
        (nv.CompiledNetwork.run_to, {"steps": None, "inputs": None, **dict.fromkeys(RUN), "body": True}),
        (nv.CompiledNetwork.simulator, {"backend": None, "start": None, "record": False, "body": True, "every": 1}),
        (nv.CompiledNetwork.render, {**dict.fromkeys(PICTURE), "full": False, "step": None, "dpi": None}),
        (nv.CompiledNetwork.animate, {**dict.fromkeys(PICTURE), "start": 0, "fps": None, "every": None}),
        (nv.sweep, {"steps": None, "jobs": 1, "scheduler": None, "path": None, "body": True, "parameters": None}),
    ],
)
def test_a_function_names_its_keywords_and_refuses_others(
    function: Callable[..., object], named: Mapping[str, object]
) -> None:
    """Also those that it shares with others, which stand in one place: for ``help`` and for completion."""
    shown = inspect.signature(function).parameters
    other = {"every": 1, "states": (), "neurons": (), "weights": "plastic", "signals": "all", "collapse": ()}
    film = {**other, "every": None}
    for name, default in named.items():
        wanted = default if default is not None else (film if "frames" in shown else other).get(name)
        assert shown[name].default == wanted, name
    assert not any(one.kind is one.VAR_KEYWORD for one in shown.values())
    needed = ["x"] * sum(one.default is one.empty for one in shown.values() if one.kind is not one.KEYWORD_ONLY)
    with pytest.raises(TypeError, match=rf"{function.__name__}\(\) got an unexpected keyword argument 'evry'"):
        function(*needed, evry=3)
