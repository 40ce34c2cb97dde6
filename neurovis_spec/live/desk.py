"""The desk: a thread that carries out what takes a while: layouts by hand, files.

In: requests of the owner. Out: answers; a View that is shown in place of another. Neither the run nor anybody who
looks on waits for it. While a neuron is dragged the latest place counts alone.
"""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Condition, RLock, Thread
from typing import Final, TypeAlias, TypeVar

from neurovis_spec.compilation import Compilation
from neurovis_spec.diagnostics import Findings, SpecError, show_text
from neurovis_spec.layout.model import Layout
from neurovis_spec.live.commands import (
    STILLS,
    Appearance,
    Fetch,
    Fit,
    Keep,
    PlaceNeuron,
    Rekeep,
    Request,
    Save,
    Unkeep,
    Unplace,
    Write,
)
from neurovis_spec.live.pins import Compile, File, Placed, Saving, SavingError, placed, saving
from neurovis_spec.live.protocol import (
    file_message,
    fitting_message,
    making_message,
    moved_message,
    placed_message,
    refused_message,
    saving_message,
    views_message,
)
from neurovis_spec.live.run import Run, Stage
from neurovis_spec.live.saved_views import Forgotten, SavedView, call, file_beside, forget, keep, restore, views_in
from neurovis_spec.live.saving import film, picture, recording, steps_for, told_by
from neurovis_spec.live.source import Source, SourceError
from neurovis_spec.live.turns import Turned
from neurovis_spec.live.view import View
from neurovis_spec.live.watch import Watch
from neurovis_spec.live.windows import Window, window_of
from neurovis_spec.live.with_events import WithEvents, with_events, without
from neurovis_spec.progress import Progress

_LOG: Final = logging.getLogger(__name__)
_Had = TypeVar("_Had")
#: Tells who has asked.
Answer: TypeAlias = Callable[[str | bytes], None]

#: Requests that wait, and placings that can be undone.
_WAITING: Final = 64
_UNDONE: Final = 200
#: Seconds in which the run has told its last steps.
_PATIENCE: Final = 30.0
#: Seconds between two words of how far a film is.
_OFTEN: Final = 0.25


@dataclass(frozen=True, eq=False)
class _Fitted:
    """What was laid out for a window, in place of what, and how it is drawn, where it is otherwise."""

    before: Placed
    after: Placed
    view: View | None


@dataclass(frozen=True)
class Written:
    """The file of a spec, and what compiles a text in its place."""

    path: Path
    compile: Compile


class Desk:
    """Carries out requests, one after the other. ``draw`` makes a View of a network, ``tell`` tells
    everybody what is put by hand; ``spec`` is where it can be saved, if anywhere."""

    def __init__(
        self,
        compiled: Compilation,
        engine: str | None,
        draw: Callable[[Compilation, Appearance, Layout], View],
        run: Run,
        tell: Callable[[str], object],
        spec: Written | None = None,
    ) -> None:
        self._draw, self._run, self._tell, self._spec = draw, run, tell, spec
        self._placed = self._earlier = placed(compiled, engine)
        self._view: View | None = None
        self._before: deque[Placed] = deque(maxlen=_UNDONE)
        self._saving: Saving | None = None
        #: the spec with events that is to be written, and as it was written last
        self._events: WithEvents | None = None
        self._noted: WithEvents | None = None
        #: the window that the network is wanted for, and whether it is being laid out for one
        self._window: Window = "default"
        self._fitting = False
        self._asked: deque[tuple[Request | _Fitted, Answer]] = deque()
        self._wake, self._work_lock = Condition(), RLock()
        self._ended = False
        self._thread = Thread(target=self._work, name="live desk", daemon=True)
        #: the saved views as they were told, and what was taken out of their file, by names
        self._known: dict[str, SavedView] = {}
        self._forgotten: dict[str, tuple[SavedView | None, Forgotten]] = {}
        #: has the views be read again when anybody has edited their file
        self._watch = None if spec is None else Watch({file_beside(spec.path)}, self._edited)

    def start(self) -> None:
        """Begin."""
        self._say()
        self._say_views()
        self._thread.start()
        if self._watch is not None:
            self._watch.start()

    def end(self) -> None:
        """Stop; a layout that is being made is not waited for long."""
        with self._wake:
            self._ended = True
            self._wake.notify()
        if self._watch is not None:
            self._watch.end()
        self._thread.join(1.0)

    def ask(self, request: Request, answer: Answer) -> None:
        """Have a request carried out."""
        with self._wake:
            if self._asked and _replaces(request, self._asked[-1][0]):
                self._asked.pop()
            if len(self._asked) >= _WAITING:
                answer(refused_message("too much is asked at once"))
                return
            self._put(request, answer)

    def _put(self, request: Request | _Fitted, answer: Answer | None = None) -> None:
        """Have this carried out after all that was asked."""
        with self._wake:
            self._asked.append((request, answer or _nobody))
            self._wake.notify()

    @property
    def placed(self) -> Placed:
        """What is put by hand."""
        return self._placed

    def renew(self, compiled: Compilation) -> Placed:
        """An edited network as it is laid out, with what was put by hand. Raises LayoutRefusalError."""
        with self._work_lock:
            self._earlier, self._placed = self._placed, self._placed.carried(compiled, self._window)
            self._forget()
            return self._placed

    def unrenew(self) -> None:
        """What was put by hand is what it was before ``renew``, as the edited network is not shown after all."""
        with self._work_lock:
            self._placed = self._earlier
            self._forget()
            self._fit()

    def _forget(self) -> None:
        """Another network: nothing of the one before can be undone or written."""
        self._view, self._saving = None, None
        self._before.clear()
        self._say()
        self._say_views()

    def _work(self) -> None:
        while True:
            with self._wake:
                self._wake.wait_for(lambda: self._asked or self._ended)
                if self._ended:
                    return
                request, answer = self._asked.popleft()
            try:
                with self._work_lock:
                    self._carry_out(request, answer)
            except SpecError as error:
                answer(refused_message(show_text(error.diagnostics, error.sources)))
            except Exception as error:  # an engine, ours or anybody's, may fail: the view goes on
                answer(refused_message(str(error.args[0] if isinstance(error, KeyError) else error)))

    def _carry_out(self, request: Request | _Fitted, answer: Answer) -> None:
        match request:
            case PlaceNeuron(done=False):
                view = self._shown()
                answer(moved_message(view.moved(self._placed.put(request.neuron, request.at).layout)))
            case PlaceNeuron():
                before, self._placed = self._placed, self._placed.put(request.neuron, request.at)
                self._before.append(before)
                self._show(answer)
            case Unplace():
                if not self._before:
                    raise SavingError("nothing was put by hand")
                self._placed = self._before.pop()
                self._show(answer)
                self._fit()
            case Save(into="events"):
                self._events, file = self._with_events()
                self._saving = Saving((file,))
                answer(saving_message([str(file.path)], file.diff, written=False, into="events"))
            case Save():
                self._events = None
                spec = self._written()
                self._saving = saving(self._placed, spec.path, spec.compile, request.into, self._own)
                names = [str(file.path) for file in self._saving.files]
                answer(saving_message(names, self._saving.diff, written=False, into=request.into))
            case Write():
                self._write(answer)
            case Fit():
                self._window = request.window
                self._fit(answer)
            case _Fitted():
                self._take(request)
            case Keep():
                self._keep(request)
                self._say_views()
            case Unkeep():
                known = self._known.get(request.name)
                self._forgotten[request.name] = known, forget(self._views(), request.name)
                self._say_views()
            case Rekeep():
                call(self._views(), request.name, request.to)
                self._say_views()
            case Fetch(what="yaml"):
                # what was shown, if anything was
                shown = None if self._events is None else self._saving
                file = self._with_events()[1] if shown is None else shown.files[0]
                answer(file_message(file.path.name, file.after.encode()))
            case Fetch():
                answer(self._fetch(request, answer))

    def _fetch(self, request: Fetch, answer: Answer) -> bytes:
        """A file of what was shown; how far a film is is told meanwhile."""
        view, name = self._shown().dressed(request.theme), self._placed.compiled.name
        network = self._placed.compiled.network
        seconds = None if request.what == "npz" else request.seconds
        steps = 1 if request.what in STILLS else steps_for(network, seconds)
        told = self._inquire(lambda source: told_by(source, steps))
        if request.what == "npz":
            return file_message(f"{name}.npz", recording(network, told))
        suffix = ".svg" if request.what == "film" else f".{request.what}"
        if request.what in STILLS:
            return file_message(f"{name}{suffix}", picture(view, told, suffix))
        return file_message(f"{name}{suffix}", film(view, told, suffix, _telling(answer)))

    def _inquire(self, tell: Callable[[Source], _Had]) -> _Had:
        """What the source tells of the network that is shown. Raises SavingError."""
        shown = self._placed.compiled.network.hash
        told, found = list[_Had](), SimpleQueue[str]()

        def look(source: Source) -> None:
            if source.network.hash != shown:
                raise SourceError("the spec was edited meanwhile")
            told.append(tell(source))
            found.put("")

        self._run.inquire(look, found.put)
        try:
            reason = found.get(timeout=_PATIENCE)
        except Empty:
            raise SavingError("the steps could not be had: the run is busy, or has ended") from None
        if reason:
            raise SavingError(reason)
        return told[0]

    def _with_events(self) -> tuple[WithEvents, File]:
        """The spec with what was turned as its events. Raises SavingError, SpecError, OSError."""
        spec = self._written()
        data = spec.path.read_bytes()
        made = with_events(data.decode(), self._placed.compiled.hash, self._inquire(_turned), spec.compile, self._noted)
        return made, File(spec.path, data, made.after)

    def _written(self) -> Written:
        if self._spec is None:
            raise SavingError("there is no file to save to")
        return self._spec

    def _own(self, text: str) -> str | None:
        """The text of the spec without the events that were written from here."""
        return None if self._noted is None else without(text, self._noted)

    def _views(self) -> Path:
        return file_beside(self._written().path)

    def _write(self, answer: Answer) -> None:
        spec, chosen = self._written(), self._saving
        if chosen is None:
            raise SavingError("nothing was chosen to be saved")
        chosen.write()
        self._saving = None
        files = [str(file.path) for file in chosen.files]
        if self._events is not None:  # nothing is drawn otherwise
            self._noted = self._events
            answer(saving_message(files, "", written=True, into="events"))
            return
        text = spec.path.read_text(encoding="utf-8-sig")
        if chosen.base is not None and self._noted is not None:
            self._noted = replace(self._noted, before=chosen.base, after=text)
        self._placed = self._placed.written(spec.compile(text if chosen.base is None else chosen.base))
        self._before.clear()
        self._say()
        answer(saving_message(files, "", written=True))

    def _shown(self) -> View:
        """The view of the layout with the neurons placed by hand."""
        wanted = self._run.appearance
        if self._view is None or self._view.appearance != wanted:
            self._view = self._draw(self._placed.compiled, wanted, self._placed.layout)
        return self._view

    def _show(self, answer: Answer, view: View | None = None) -> None:
        """Show the layout with the neurons placed by hand, at the current step, as it may have been drawn before."""
        self._view, self._saving = view, None
        drawn, shown = self._shown(), self._placed.compiled.hash

        def change(source: Source) -> Stage:
            if source.network.hash != shown:
                raise SourceError("the spec was edited meanwhile")
            return source, drawn

        self._run.change(change, lambda reason: answer(refused_message(reason)))
        self._say()

    def _fit(self, answer: Answer | None = None) -> None:
        """Have the network laid out for the window, beside the desk, if it is not; what was put by hand stays."""
        before, window = self._placed, self._window
        if self._fitting:
            return
        if window == before.window or before.moved or self._before:
            (answer or _nobody)(self._fitted())
            return
        self._fitting = True

        def lay_out() -> None:
            made = _Fitted(before, replace(before, window=window), None)
            try:
                after = before.for_window(window)
                same = after.layout is before.layout
                view = None if same else self._draw(after.compiled, self._run.appearance, after.layout)
                made = _Fitted(before, after, view)
            except Exception as error:  # an engine, ours or anybody's, may fail: the picture stays as it is
                _LOG.error("the network cannot be laid out for a window", exc_info=error)
            self._put(made)

        self._tell(fitting_message(window, window_of(before.compiled)))
        Thread(target=lay_out, name="live fitting", daemon=True).start()

    def _take(self, made: _Fitted) -> None:
        """Show the network as it was laid out for a window, if it is the one that is shown."""
        self._fitting = False
        if self._placed is made.before and not self._before and made.after.window == self._window:
            self._placed = made.after
            if made.view is not None:
                self._show(_nobody, made.view)
        self._fit()
        if not self._fitting:
            self._tell(self._fitted())

    def _fitted(self) -> str:
        """That nothing is being laid out for a window, and for which the network is that is shown."""
        return fitting_message(None, window_of(self._placed.compiled))

    def _keep(self, request: Keep) -> None:
        """Put a view into its file; one that was taken out as it was, where nothing else has changed since."""
        known, forgotten = self._forgotten.pop(request.name, (None, None))
        if known != request.view or forgotten is None or not restore(self._views(), forgotten):
            keep(self._views(), request.name, request.view)

    def _say_views(self) -> None:
        """Tell everybody which views are saved, where they can be."""
        if self._spec is not None:
            path, findings = file_beside(self._spec.path), Findings()
            views = self._known = views_in(path, self._placed.compiled.network, findings)
            self._tell(views_message(path.name, views, show_text(findings.sorted(), findings.sources)))

    def _edited(self) -> Iterable[Path]:
        """The file of views was edited."""
        with self._work_lock:
            self._say_views()
            return {self._views()}

    def _say(self) -> None:
        """Tell everybody what is put by hand."""
        self._tell(placed_message(self._placed.moved, undo=bool(self._before), files=self._spec is not None))


def _turned(source: Source) -> tuple[Turned, ...]:
    """What was turned. Raises SourceError where nothing can be."""
    if "undo" not in source.capabilities.takes:
        raise SourceError("nothing is turned in what is played: it has no events to be saved")
    return source.turned


def _telling(answer: Answer) -> Progress:
    """What tells now and then how far something is."""
    last = [-_OFTEN]

    def tell(done: int, total: int) -> None:
        now = time.monotonic()
        if now - last[0] >= _OFTEN:
            last[0] = now
            answer(making_message(done, total))

    return tell


def _nobody(text: str | bytes) -> None:
    """Nobody has asked."""


def _replaces(request: Request, before: Request | _Fitted) -> bool:
    """Whether a request makes one that waits superfluous: a neuron is dragged on."""
    if not (isinstance(request, PlaceNeuron) and isinstance(before, PlaceNeuron)):
        return False
    return not before.done and before.neuron == request.neuron
