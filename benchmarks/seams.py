"""Seams: pairs of features held against each other over random specs, many of them, from a seed.

In: how many specs, and from which number on. Out: for each seam how many specs went through it, on standard output;
status 1 where a law was broken, with the numbers to run again:

    python benchmarks/seams.py --specs 2000
    python benchmarks/seams.py --first 371 --specs 1 --seam live

- *backends*: those that promise the bits of the reference give them, NumPy the same numbers within 1e-9;
- *pieces*: a run in one go is the same run in pieces by checkpoints, and step by step, to the bit;
- *formats*: what a run writes is read back the same, whatever was recorded in whichever format; a picture of it, and a
  run that goes on from it, are made or refused in words;
- *live*: whatever is turned, gone back to, branched and saved in the live view, each step and the saved file are those
  of a run with the events that were turned (drags apart, of which the last value alone is told);
- *sweep*: each row of a sweep over seeds and parameters is the run with that seed and these parameters;
- *format*: the formatted text means the same network.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Literal

import numpy as np
import yaml

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

from random_specs import Plain
from seam_specs import Author

import neurovis_spec as nv
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.language.format.canonical import format_read
from neurovis_spec.live.saving import recording as saved
from neurovis_spec.live.saving import told_by
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import SourceError
from neurovis_spec.live.turns import Feed, Hold, Learn, Lesion, Mend, Release, Set, Turn, Turned
from neurovis_spec.runtime.backend import load
from neurovis_spec.runtime.recording import Recording


class BrokenError(AssertionError):
    """A law does not hold."""


def same(what: str, one: Recording, other: Recording) -> None:
    """The same bits in all that two recordings hold."""
    pairs = {name: (getattr(one, name), getattr(other, name)) for name in ("step", "activity", "weights", "states")}
    pairs["after"] = (one.weights_after, other.weights_after)
    for name, (a, b) in pairs.items():
        if a.shape != b.shape or not np.array_equal(a, b, equal_nan=True):
            raise BrokenError(f"{what}: {name} differs, shapes {a.shape} {b.shape}, first {np.argwhere(a != b)[:1]}")


def backends(compiled: CompiledNetwork, author: Author, choose: random.Random, folder: Path) -> None:
    states = choose.sample(author.states, min(2, len(author.states)))
    made = {name: compiled.run(40, backend=name, states=states) for name in ("reference", "numpy", "c")}
    for backend, found in made.items():
        if load(backend).capabilities.exactness == "bits":
            same(f"reference and {backend}", made["reference"], found)
            continue
        for name in ("activity", "weights", "states"):
            one, other = getattr(made["reference"], name), getattr(found, name)
            if not np.allclose(one, other, rtol=1e-9, atol=1e-9, equal_nan=True):
                raise BrokenError(f"{backend}: {name} is off by {np.nanmax(np.abs(one - other))}")


def pieces(compiled: CompiledNetwork, author: Author, choose: random.Random, folder: Path) -> None:
    whole, made, at = compiled.run(40), list[Recording](), 0
    kept = folder / "kept.npz"
    while at < 40:
        steps = min(40 - at, choose.randrange(1, 20))
        made.append(compiled.run(steps, checkpoint=kept))
        at += steps
    for name in ("activity", "weights"):
        if not np.array_equal(
            np.concatenate([getattr(one, name) for one in made]), getattr(whole, name), equal_nan=True
        ):
            raise BrokenError(f"checkpoints: {name} differs")
    simulation = compiled.simulator()
    rows = []
    for _ in range(40):
        simulation.step()
        rows.append(simulation.activity)
    if not np.array_equal(np.array(rows), whole.activity, equal_nan=True):
        raise BrokenError("step by step: activity differs")


def formats(compiled: CompiledNetwork, author: Author, choose: random.Random, folder: Path) -> None:
    names = list(compiled.network.neurons.names)
    neurons = [] if choose.random() < 0.3 else choose.sample(names, choose.randrange(1, len(names) + 1))
    states = choose.sample(author.states, choose.randrange(0, len(author.states) + 1))
    kept: Literal["plastic", "none"] = "plastic" if choose.random() < 0.7 else "none"
    every, suffix = (
        choose.choice([1, 1, 3, 7]),
        choose.choice([".npz", ".csv", ".mcap"] if not neurons else [".npz", ".csv"]),
    )
    path = folder / f"run{suffix}"
    made = compiled.run(30, every=every, states=states, neurons=neurons, weights=kept)
    compiled.run_to(path, 30, every=every, states=states, neurons=neurons, weights=kept)
    told = f"{suffix} neurons={neurons} states={states} weights={kept} every={every}"
    found = nv.load(path)
    for name in ("step", "activity", "weights", "states"):
        one, other = getattr(made, name), getattr(found, name)
        if one.shape != other.shape or not np.array_equal(one, other, equal_nan=True):
            raise BrokenError(f"{told}: {name} is {other.shape}, not {one.shape}, or differs")
    if (made.state_names, _recorded(made)) != (found.state_names, _recorded(found)):
        raise BrokenError(f"{told}: names are {found.state_names} {found.neurons}")
    for use in (
        lambda: compiled.render(folder / "x.svg", recording=found),
        lambda: compiled.run(5, start=found),
        lambda: found.cross_correlation(),
        lambda: compiled.animate(folder / "x.svg", recording=found),
    ):
        try:
            use()
        except (nv.SpecError, ValueError, KeyError) as error:
            if not str(error) or "shape" in str(error) or "broadcast" in str(error):
                raise BrokenError(f"{told}: {type(error).__name__} {error}") from error


def _recorded(recording: Recording) -> list[str]:
    """The neurons whose activities a recording holds."""
    names = recording.neurons
    return [names[index] for index in (range(len(names)) if recording.recorded is None else recording.recorded)]


def live(compiled: CompiledNetwork, author: Author, choose: random.Random, folder: Path) -> None:
    source = SimulatedSource(compiled.simulator())
    told: list[str] = []
    for _ in range(choose.randrange(5, 25)):
        told.append(_command(source, author, choose))
    turned, last = source.turned, source.step
    events = _events(turned)
    spec = dict(author.spec)
    given = spec.get("events", [])
    assert isinstance(given, list)
    again = nv.compile({**spec, "events": [*given, *events]})
    seen = source.recall(10_000)
    at_an_event = {change.at - 1 for change in compiled.network.changes}
    if any(
        isinstance(one.turn, Feed) or (isinstance(one.turn, Mend | Lesion) and one.step in at_an_event)
        for one in turned
    ):
        return  # no event says what was fed, and of what a step lesions and mends the events' own order is another
    run = again.run(last + 1)
    for one in seen:
        if not np.array_equal(one.snapshot.activity, run.activity[one.snapshot.step], equal_nan=True):
            raise BrokenError(f"step {one.snapshot.step} of {last}: activity; {told} {events}")
    _compare_saved(compiled, source, run, f"{told} {events}", folder)


def _compare_saved(compiled: CompiledNetwork, source: SimulatedSource, run: Recording, told: str, folder: Path) -> None:
    path = folder / "saved.npz"
    path.write_bytes(saved(compiled.network, told_by(source, 10_000)))
    found = nv.load(path)
    names = compiled.network.connection_names
    for step in found.step.tolist():
        if not np.array_equal(found.snapshot(step).activity, run.snapshot(step).activity, equal_nan=True):
            raise BrokenError(f"saved activity of step {step}: {told}")
        one, other = found.snapshot(step).weights, run.snapshot(step).weights
        if not np.array_equal(one, other, equal_nan=True):
            wrong = [names[index] for index in np.flatnonzero(one != other)[:3]]
            raise BrokenError(f"saved weights of step {step} {wrong}: {told}")


def _command(source: SimulatedSource, author: Author, choose: random.Random) -> str:
    """One command; what it was."""
    kind = choose.choice(["on", "on", "on", "back", "turn", "turn", "turn", "branch", "restart"])
    if kind == "on":
        steps = choose.choice([1, 2, 5, 30, 70])
        for _ in range(steps):
            source.advance()
        return f"on {steps}"
    if kind == "back":
        step = choose.randint(source.reach.first, source.reach.last)
        source.go(step)
        return f"go {step}"
    if kind == "branch":
        source.branch()
        return "branch"
    if kind == "restart":
        if choose.random() < 0.7:
            return "-"
        source.restart()
        return "restart"
    what = _turn(author, choose)
    try:
        source.turn(what)
    except SourceError as error:
        return f"refused {what}: {error}"
    return f"{source.step}: {what}"


def _turn(author: Author, choose: random.Random) -> Turn:
    group = choose.choice(list(author.groups))
    part = choose.choice([group, *author.entries])
    turns: list[Turn] = [
        Set({"a": round(choose.uniform(0.1, 0.9), 3)}),
        Set({"b": round(choose.uniform(0.1, 0.9), 3)}),
        Set({"eta": round(choose.uniform(0, 0.2), 3)}),
        Hold(group, round(choose.uniform(-1, 1), 3)),
        *([] if author.clamps else [Release(group)]),  # no event ends what another event clamps
        Lesion(part),
        Mend(part),
        Learn(part, choose.random() < 0.5),
        *([Feed("push", (0.5,))] if choose.random() < 0.1 else []),
    ]
    return choose.choice(turns)


def _events(turned: Sequence[Turned]) -> list[Plain]:
    """The events that a user would copy: of a value that is given twice at one step the last counts."""
    events: list[Plain] = []
    for place, entry in enumerate(turned):
        at, what = entry.step + 1, entry.turn
        later = turned[place + 1 :]
        if isinstance(what, Set):
            values = {
                name: value
                for name, value in what.values.items()
                if not any(o.step == entry.step and isinstance(o.turn, Set) and name in o.turn.values for o in later)
            }
            events += [{"at": at, "set": {name: value}} for name, value in values.items()]
        elif isinstance(what, Hold):
            same_neurons = [o for o in later if isinstance(o.turn, Hold | Release) and o.turn.neurons == what.neurons]
            if same_neurons and same_neurons[0].step == entry.step:
                continue
            event: dict[str, Plain] = {"from": at, "clamp": {what.neurons: what.value}}
            events.append({**event, "to": same_neurons[0].step + 1} if same_neurons else event)
        elif isinstance(what, Lesion | Mend):
            if any(
                o.step == entry.step and isinstance(o.turn, Lesion | Mend) and o.turn.part == what.part for o in later
            ):
                continue
            events.append({"at": at, "lesion" if isinstance(what, Lesion) else "mend": [what.part]})
        elif isinstance(what, Learn):
            if any(
                o.step == entry.step and isinstance(o.turn, Learn) and o.turn.connections == what.connections
                for o in later
            ):
                continue
            events.append({"at": at, "learning": {what.connections: what.on}})
    return events


def sweep(compiled: CompiledNetwork, author: Author, choose: random.Random, folder: Path) -> None:
    metric = f"mean({compiled.network.neurons.names[0]})"
    seeds = [choose.randrange(1000) for _ in range(2)]
    table = nv.sweep(author.spec, {"a": [0.2, 0.5], "seed": seeds}, metric, steps=20)
    for a, seed, found in zip(table["a"], table["seed"], table[metric], strict=True):
        assert isinstance(a, float)
        assert isinstance(seed, int)
        alone = nv.compile(author.spec, parameters={"a": a}, seed=seed)
        wanted = alone.measure(metric, alone.run(20))[-1]
        if found != wanted and not (found != found and np.isnan(wanted)):
            raise BrokenError(f"a = {a}, seed {seed}: {found} is not {wanted}")


class _Plainly(yaml.SafeDumper):
    """Without anchors, which the language has not."""

    def ignore_aliases(self, data: object) -> bool:
        return True


def format_(compiled: CompiledNetwork, author: Author, choose: random.Random, folder: Path) -> None:
    text = yaml.dump(
        author.spec, Dumper=_Plainly, sort_keys=False, default_flow_style=choose.choice([None, False, True])
    )
    once = format_read(text)
    if format_read(once) != once or nv.compile_text(once).hash != compiled.hash:
        raise BrokenError("the formatted text is not canonical, or another network")


SEAMS: dict[str, Callable[[CompiledNetwork, Author, random.Random, Path], None]] = {
    "backends": backends,
    "pieces": pieces,
    "formats": formats,
    "live": live,
    "sweep": sweep,
    "format": format_,
}


def go_through(seams: Sequence[str], number: int) -> list[tuple[str, str]]:
    """Each seam, and how its law was broken; nothing where it holds."""
    failures = []
    author = Author(number)
    try:
        compiled = nv.compile(author.write())
    except nv.SpecError as error:
        return [("compile", str(error))]
    for seam in seams:
        with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            try:
                SEAMS[seam](compiled, author, random.Random(number), Path(folder))
            except BrokenError as error:
                failures.append((seam, str(error)))
            except Exception:
                failures.append((seam, traceback.format_exc()))
    return failures


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--specs", type=int, default=2000, help="how many specs")
    options.add_argument("--first", type=int, default=0, help="the number of the first")
    options.add_argument("--seam", choices=tuple(SEAMS), action="append", help="these alone")
    options.add_argument("--jobs", type=int, default=2, help="processes")
    given = options.parse_args()
    seams = given.seam or list(SEAMS)
    broken: Counter[str] = Counter()
    numbers = range(given.first, given.first + given.specs)
    with ProcessPoolExecutor(given.jobs) as pool:
        for number, failures in zip(numbers, pool.map(partial(go_through, seams), numbers, chunksize=10), strict=True):
            for seam, why in failures:
                broken[seam] += 1
                if broken[seam] <= 3:
                    print(f"spec {number}, {seam}: {why}", flush=True)
    for seam in ["compile", *seams]:
        print(f"{seam}: {given.specs} specs, {broken[seam]} broken")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
