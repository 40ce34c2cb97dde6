"""What is drawn of a network, as scenes, for the tests that look at their shapes."""

from __future__ import annotations

from collections.abc import Collection

from neurovis_spec.compilation import Compilation
from neurovis_spec.compiler.drawing.drawing_settings import RenderSettings
from neurovis_spec.layout import Layout
from neurovis_spec.runtime.recording import Snapshot
from neurovis_spec.scene import Film, Scene
from neurovis_spec.scene.film import film, scene_of_step
from neurovis_spec.scene.renderers import drawing


def scene_of(
    network: Compilation, snapshot: Snapshot, layout: Layout | None = None, settings: RenderSettings | None = None
) -> Scene:
    """One step, in the layout that pictures of the network have, or in another one."""
    layout, settings = layout or network.placed(), settings or network.network.render
    return scene_of_step(network.network, layout, snapshot, network.gains, settings)


def film_of(
    network: Compilation, snapshots: Collection[Snapshot], layout: Layout | None = None, fps: float = 25
) -> Film:
    """Several steps."""
    whole, layout = network.network, layout or network.placed()
    return film(whole, layout, snapshots, network.gains, whole.render, fps)


def file_of(scene: Scene, suffix: str) -> bytes:
    """A scene as the content of a file of this kind."""
    return drawing(scene, suffix)
