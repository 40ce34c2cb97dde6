"""The widget: a live view in a cell of a notebook, whose parameters are traits.

In: a compiled network and what is shown of it. Out: an anywidget. What its frames in the notebook send is passed on to
the session, and what the session has for them is sent; parameters that are turned anywhere are the same everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future
from importlib.util import find_spec
from keyword import iskeyword
from pathlib import Path
from typing import Final

from neurovis_spec.compilation import Compilation
from neurovis_spec.live.commands import Command, Pause, Play, Restart, Seek
from neurovis_spec.live.shipped import page
from neurovis_spec.live.show import Show
from neurovis_spec.live.turns import Set
from neurovis_spec.notebook.session import Session
from neurovis_spec.pipeline import svg_at_rest

if find_spec("anywidget") is None:
    raise ImportError(
        "the live view in a notebook needs anywidget: pip install 'neurovis-spec[jupyter]'", name="anywidget"
    )

import anywidget
import numpy as np
import traitlets

#: Seconds that whoever asks for something waits for its answer: a step may take long.
_PATIENCE: Final = 10.0
#: The most characters of a frame's name.
_LONGEST: Final = 64
#: The height of the page's bar, and the least and the most that a widget begins with, in pixels.
_BAR, _LEAST, _MOST = 44, 320, 640


class Parameter(traitlets.TraitType[float, float]):
    """A parameter of a live run: to set it is to turn it, from the next step on."""

    info_text = "a number"

    def __init__(self, name: str, value: float, help: str) -> None:
        super().__init__(value, help=help)
        self.parameter = name

    def validate(self, obj: LiveWidget, value: object) -> float:
        """The number, when the run has taken it. Raises TraitError for what is none, and for what is refused."""
        if isinstance(value, bool) or not isinstance(value, int | float | np.number):
            self.error(obj, value)
        number = float(value)
        obj._set_parameter(self.parameter, number)
        return number


class LiveWidget(anywidget.AnyWidget):
    """A network that runs in a cell, or a recording of it that plays; ``network.live()`` makes one.

    Each parameter that can be set is a trait of its name (a name that a widget has already, such as ``layout``, and a
    keyword of Python get an underscore behind them). ``step`` and ``playing`` are traits that are read. Functions that
    observe traits may be called in the view's own thread.
    """

    _esm = (Path(__file__).parent / "widget.js").read_text(encoding="utf-8")
    title = traitlets.Unicode().tag(sync=True)
    height = traitlets.Int(_LEAST, help="pixels").tag(sync=True)
    step = traitlets.Int(0, read_only=True, help="the step that is shown")
    playing = traitlets.Bool(False, read_only=True, help="whether it plays")

    def __init__(self, compiled: Compilation, show: Show, play: bool = True) -> None:
        super().__init__()
        stage = show.stage(compiled)
        frame = stage[1].plan.frame
        self._compiled, self._layout = compiled, compiled.placed(show.engine)
        self.title = f"{stage[1].plan.title} – NeuroVis"
        self.height = min(max(round(frame.height * frame.density) + _BAR, _LEAST), _MOST)
        self._known: dict[str, float] = {}
        self._names: dict[str, str] = {}
        self._session = Session(stage, self._tell_frame, self._follow_run, play)
        self._declare(compiled, stage[0].parameters)
        self._session.begin()
        self.on_msg(self._take_message)

    def __repr__(self) -> str:
        return f"<live view of {self._compiled.name}>"

    def _repr_svg_(self) -> str:
        """The network before anything happens, for where a notebook is read that does not run."""
        return svg_at_rest(self._compiled, self._layout)

    def play(self) -> None:
        """Go on."""
        self._ask(Play())

    def pause(self) -> None:
        """Stand still."""
        self._ask(Pause())

    def go(self, step: int) -> None:
        """Go to a step, and stand still. Raises ValueError for one out of reach."""
        self._ask(Seek(step))

    def restart(self) -> None:
        """Begin anew; nothing is turned."""
        self._ask(Restart())

    def close(self) -> None:
        """End the run, and take the widget out of the notebook."""
        if hasattr(self, "_session"):
            self._session.end()
        super().close()

    def _declare(self, compiled: Compilation, parameters: dict[str, float]) -> None:
        """A trait for each parameter."""
        traits: dict[str, Parameter] = {}
        for name, value in parameters.items():
            written = compiled.spec.parameters.get(name)
            trait = name
            while trait in traits or hasattr(self, trait) or iskeyword(trait):
                trait += "_"
            traits[trait] = Parameter(name, value, help="" if written is None else written.about)
            self._known[name], self._names[name] = value, trait
        self.add_traits(**traits)

    def _set_parameter(self, name: str, value: float) -> None:
        """Have a parameter set by the run, unless it is that already. Raises TraitError."""
        before = self._known[name]
        if before == value:
            return
        self._known[name] = value
        try:
            self._ask(Set({name: value}))
        except ValueError as error:
            self._known[name] = before
            raise traitlets.TraitError(str(error)) from None

    def _ask(self, command: Command) -> None:
        """Ask for something, and wait until it is done. Raises ValueError where it is refused, TimeoutError where the
        run does not come to it for long."""
        answer: Future[None] = Future()
        self._session.ask(
            command, lambda reason: answer.set_exception(ValueError(reason)), lambda: answer.set_result(None)
        )
        try:
            answer.result(_PATIENCE)
        except TimeoutError:
            what = type(command).__name__.lower()
            message = f"the run has not come to '{what}' for {_PATIENCE:g} s, as its steps take long: it will later"
            raise TimeoutError(message) from None
        self._follow_run()

    def _follow_run(self) -> None:
        """Have the traits say what is shown."""
        shown = self._session.shown
        self.set_trait("step", shown.glance.step)
        self.set_trait("playing", shown.status.playing)
        for name, value in shown.status.parameters.items():
            if self._known.get(name, value) != value:
                self._known[name] = value
                setattr(self, self._names[name], value)

    def _tell_frame(self, view: str, message: bytes | str) -> None:
        """Send a frame a message: the page first, then those of the protocol."""
        if isinstance(message, bytes):
            self.send({"view": view}, [message])
        else:
            self.send({"view": view, "text": message})

    def _take_message(self, _: object, content: object, buffers: Sequence[bytes | memoryview]) -> None:
        """What a frame sends: that it wants the page, has come or gone, or a message of the protocol."""
        view = content.get("view") if isinstance(content, dict) else None
        if not isinstance(content, dict) or not isinstance(view, str) or not 0 < len(view) <= _LONGEST:
            return
        match content:
            case {"page": True}:
                self.send({"view": view, "page": page()})
            case {"open": True}:
                self._session.join(view)
            case {"open": False}:
                self._session.leave(view)
            case {"text": str(text)}:
                self._session.take(view, text)
            case _ if len(buffers) == 1:
                self._session.take(view, bytes(buffers[0]))
