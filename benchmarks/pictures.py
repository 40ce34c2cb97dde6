"""Pictures: ours beside matplotlib with networkx, skia-python and naive Pillow, in one run.

``.venv/bin/python benchmarks/pictures.py [NEURONS…]``; ``… pictures.py body``: frames of use case 2 with its body, and
without. Every contender draws the same step of the same network in as
many pixels, in a process of its own: seconds of the processor and memory of a still with its PNG, and frames of a film
(in memory, not encoded) by the clock and for each second of the processor. skia-python and Pillow draw the same shapes,
matplotlib with networkx its nodes and edges at the same places. The peers are no dependencies: ``pip install matplotlib
skia-python``. What is not installed is a dash.
"""

from __future__ import annotations

import io
import pickle
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import picture_peers
from neurovis_renderers.canvas import paint
from neurovis_renderers.frames import frames
from neurovis_renderers.moving import Moving, Painter
from neurovis_renderers.raster import PillowRenderer

from neurovis_spec import api
from neurovis_spec.compiler.drawing.drawing_settings import Panel
from neurovis_spec.scene import Film, Scene
from neurovis_spec.scene.figure import PageGains, figure
from neurovis_spec.scene.film import film, scene_of_step, still
from neurovis_spec.scene.look import Look
from neurovis_spec.scene.shots import shots_of

#: neurons and connections, about: those of networks that are drawn at random
SIZES = ((12, 28), (200, 400), (448, 7379), (5000, 96651))
_STEPS, _LONGEST, _FILM = 40, 60.0, 3.0
_TIMES = 5
_USE_CASE = Path(__file__).parents[1] / "specs" / "cpg_rbf.yaml"
_SPEC = """neurovis: 1
name: random
time: {{steps: {steps}}}
neurons: {{R: {{count: {neurons}, activation: tanh, initial: "uniform(-1, 1)"}}}}
connections:
  R -> R: {{weight: "normal(0, {deviation})", pattern: {{random: {{probability: {probability}}}}}}}
"""
Stills = Callable[[Scene], bytes]

STILLS: dict[str, Stills] = {
    "ours": lambda scene: PillowRenderer().draw(scene, ".png"),
    "skia-python": picture_peers.skia_still,
    "naive Pillow": picture_peers.pillow_still,
    "matplotlib, networkx": picture_peers.matplotlib_still,
}


def prepared(neurons: int, connections: int, folder: Path) -> Path:
    """A file with the scene of a step, and one with a film."""
    probability = connections / neurons**2
    text = _SPEC.format(
        steps=_STEPS, neurons=neurons, deviation=1.6 / (neurons * probability) ** 0.5, probability=probability
    )
    network = api.compile(_USE_CASE) if neurons == 12 else api.compile_text(text)
    recording, layout, settings = network.run(_STEPS), network.drawn().value, network.network.render
    snapshot = recording.snapshot(_STEPS - 1)
    path = folder / str(neurons)
    scene = scene_of_step(network.network, layout, snapshot, network.gains, settings)
    (path.with_suffix(".scene")).write_bytes(pickle.dumps(scene))
    shots = shots_of(network.network, recording, Look(settings, first=0, count=_STEPS, fps=25.0))
    moving = film(network.network, layout, shots.snapshots(network.network), network.gains, settings, 25.0)
    (path.with_suffix(".film")).write_bytes(pickle.dumps(moving))
    counts = len(network.network.neurons), len(network.network.connections)
    print(f"\n{counts[0]:,}/{counts[1]:,}, {scene.pixels[0]} × {scene.pixels[1]} pixels, engine {layout.engine}")
    return path


def measure_still(name: str, path: Path) -> None:
    """In a process of its own: seconds of the processor, MiB more than before, kB of the file."""
    scene: Scene = pickle.loads(path.with_suffix(".scene").read_bytes())
    before, begun = most_memory(), time.process_time()
    data = STILLS[name](scene)
    seconds = time.process_time() - begun
    grown = most_memory() - before
    print(f"{seconds:8.2f} s {grown:7.0f} MiB {len(data) / 1000:8.0f} kB", end="")


def most_memory() -> float:
    """The most MiB that this process has held; getrusage knows of those of its parent, too."""
    (line,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM"))
    return int(line.split()[1]) / 1024


def measure_film(name: str, path: Path) -> None:
    """In a process of its own: frames a second."""
    film: Film = pickle.loads(path.with_suffix(".film").read_bytes())
    pictures = _pictures(name, film)
    next(pictures)  # what frames have in common is worked out once
    begun, used, count = time.perf_counter(), time.process_time(), 0
    while time.perf_counter() - begun < _FILM:
        next(pictures)
        count += 1
    clock, processor = count / (time.perf_counter() - begun), count / (time.process_time() - used)
    print(f" {clock:8.1f} frames/s, {processor:8.1f} for each of the processor", end="")


def _pictures(name: str, film: Film) -> Iterator[object]:
    while True:
        if name == "ours":
            yield from frames(film)
        else:
            yield from (STILLS[name](still(film, frame)) for frame in range(film.frames))


def apart(what: str, name: str, path: Path) -> str:
    """What a process of its own prints."""
    command = [sys.executable, __file__, what, name, str(path)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_LONGEST, check=False)
    except subprocess.TimeoutExpired:
        return f"  more than {_LONGEST:.0f} s"
    return done.stdout if done.returncode == 0 else f"  – {done.stderr.strip().splitlines()[-1][:60]}"


def check_alike(path: Path) -> None:
    """What skia draws of the shapes is what ours shows, so that both do the same work."""
    scene: Scene = pickle.loads(path.with_suffix(".scene").read_bytes())
    try:
        theirs = _pixels(picture_peers.skia_still(scene))
    except ImportError:
        return
    apart = np.abs(theirs.astype(int) - paint(scene)).mean()
    print(f"skia's pixels differ from ours by {apart:.2f} of 255 on the mean")


def _pixels(png: bytes) -> npt.NDArray[np.uint8]:
    from PIL import Image

    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def measure_body() -> None:
    """Milliseconds of the processor for a frame of a film, without a body and with one; of each frame the least of
    several, since other work makes any of them longer."""
    network = api.compile(_USE_CASE.with_name("walk") / "walk.yaml")
    recording, layout, settings = network.run(_STEPS), network.drawn().value, network.network.render
    for views in (("network",), ("network", "body")):
        look = Look(settings, tuple(Panel(view) for view in views), first=0, count=_STEPS, fps=25.0)
        shots, gains = shots_of(network.network, recording, look), PageGains(network.gains, network.gains)
        moving = figure(network.network, layout, look, shots, gains)
        painter, least = Painter(Moving(moving)), np.full(_STEPS, np.inf)
        for frame in _TIMES * (0, *range(_STEPS)):
            begun = time.process_time()
            painter.paint(frame)
            least[frame] = min(least[frame], time.process_time() - begun)
        wide, high = moving.scene.pixels
        print(f"{' and '.join(views):18}{wide} × {high}: {1000 * least.mean():6.1f} ms a frame", flush=True)


def main() -> None:
    if sys.argv[1:] == ["body"]:
        measure_body()
        return
    chosen = [int(text) for text in sys.argv[1:]]
    with tempfile.TemporaryDirectory() as folder:
        for neurons, connections in SIZES:
            if chosen and neurons not in chosen:
                continue
            path = prepared(neurons, connections, Path(folder))
            for name in STILLS:
                print(f"{name:22}{apart('still', name, path)}{apart('film', name, path)}", flush=True)
            check_alike(path)


if __name__ == "__main__":
    if sys.argv[1:2] == ["still"]:
        measure_still(sys.argv[2], Path(sys.argv[3]))
    elif sys.argv[1:2] == ["film"]:
        measure_film(sys.argv[2], Path(sys.argv[3]))
    else:
        main()
