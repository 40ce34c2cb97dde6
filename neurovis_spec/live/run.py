"""The run: a thread that drives a source by the clock and shows what is seen.

In: a Source, its View, and commands. Out: Looks and a Status, given to a function that must not wait. Nobody who looks
on can hold the thread up: commands come in a queue, and what is shown is handed over.
"""

from __future__ import annotations

import logging
import math
import time
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Final, ParamSpec, TypeAlias

from neurovis_spec.arrays import FloatArray
from neurovis_spec.body import BodyError
from neurovis_spec.compiler.network import Network
from neurovis_spec.diagnostics import SpecError
from neurovis_spec.live.aside import Aside, Compared
from neurovis_spec.live.clock import FRAMES, Clock, Pace
from neurovis_spec.live.commands import (
    Appearance,
    Branch,
    Branching,
    Command,
    Compare,
    Draw,
    Event,
    Forget,
    Loop,
    Measure,
    Pause,
    Play,
    Present,
    Rename,
    Restart,
    Restore,
    Seek,
    Speed,
    Step,
    Switch,
    Undo,
    Unloop,
    Unmeasure,
)
from neurovis_spec.live.curves import series_of
from neurovis_spec.live.futures import Futures
from neurovis_spec.live.history import History
from neurovis_spec.live.series import Series
from neurovis_spec.live.source import Capabilities, Drawn, Reach, Seen, Source, SourceError
from neurovis_spec.live.turns import Turned
from neurovis_spec.live.typed import Typed
from neurovis_spec.live.undefined import Undefined, undefined_in
from neurovis_spec.live.view import Glance, View
from neurovis_spec.runtime.errors import RecordingError

_LOG: Final = logging.getLogger(__name__)
P = ParamSpec("P")


@dataclass(frozen=True, slots=True)
class Status:
    """What a client is told of a run when it changes: ``ended`` where there is no further step; ``events``, the steps
    at which the spec has some; ``backend``, what makes the steps, "" where that is not known;
    ``futures``, what else the run has done behind steps of its past; ``branch``, the name of what it does, "" without
    one; ``measures``, the number and the text of each that
    somebody has typed; ``loop``, the first and the last step of what is played over and over; ``compared``, the number
    of the future that is shown beside it."""

    playing: bool
    speed: float
    ended: bool
    capabilities: Capabilities
    parameters: Mapping[str, float]
    fed: Mapping[str, tuple[float, ...]]
    learning: Mapping[str, bool | None]
    turned: tuple[Turned, ...]
    events: tuple[int, ...]
    appearance: Appearance
    backend: str
    futures: Futures
    branch: str
    measures: tuple[tuple[int, str], ...] = ()
    loop: tuple[int, int] | None = None
    compared: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """All that is shown of the current step. ``view`` and ``body`` are replaced when the network is edited."""

    view: View
    seen: Seen
    glance: Glance
    reach: Reach
    status: Status
    history: History
    body: Drawn
    quantities: FloatArray | None
    undefined: Undefined | None
    compared: Compared | None = None


Stage: TypeAlias = tuple[Source, View]
#: Called with what is shown; must not wait.
Show: TypeAlias = Callable[[Shown], None]
#: Called with what was refused and why.
Refuse: TypeAlias = Callable[[str], None]
#: Called when what was asked is done.
Done: TypeAlias = Callable[[], None]
#: Gives what to show in place of a source, such as an edited network.
Change: TypeAlias = Callable[[Source], Stage]


@dataclass(frozen=True, slots=True, eq=False)
class _Drawn:
    """A view that was drawn otherwise; None: it cannot be, and why."""

    instead_of: View
    wanted: Appearance
    view: View | None
    why: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class _Inquiry:
    """A function to be called with the source, in the thread of the run."""

    what: Callable[[Source], object]


def _known(source: Source, number: int) -> Futures:
    """The futures, one of which has this number. Raises SourceError."""
    if not source.futures.path(number):
        raise SourceError("this branch is no longer kept")
    return source.futures


def _ignore(message: str) -> None:
    """Nobody is told."""


def _nothing() -> None:
    """Nobody waits."""


def _call(what: Callable[P, object], *given: P.args, **named: P.kwargs) -> None:
    """Call what another thread gave to be called; what fails there is no failure of the run."""
    try:
        what(*given, **named)
    except Exception:
        _LOG.exception("whoever looks on at the live run failed, and it goes on")


class Run:
    """A live run; it plays from the start on, or stands still where it is not ``playing``. ``wanted`` says whether
    anybody looks on: else nothing is shown. Whatever a source or a view raises, the run goes on: what was asked is
    refused, and all is as it was before; where nobody has asked, ``tell`` is called with why it stands still. What
    ``show``, ``tell`` and those who ask raise themselves is logged.
    ``failure`` is the last that was raised which is no SourceError."""

    def __init__(
        self,
        source: Source,
        view: View,
        show: Show,
        wanted: Callable[[], bool] = lambda: True,
        tell: Refuse = _ignore,
        playing: bool = True,
    ) -> None:
        self._source, self._view, self._show, self._wanted, self._tell = source, view, show, wanted, tell
        self._asked: SimpleQueue[tuple[Command | Change | _Drawn | _Inquiry | None, Refuse, Done]] = SimpleQueue()
        self._playing, self._ended = playing, False
        #: how the picture is wanted, and whether it is being drawn so
        self.appearance, self._drawing = view.appearance, False
        #: the step to go to, which is further than has been reached
        self._target: int | None = None
        #: what was not finite at the step that was shown last, and of what that was true
        self._undefined: tuple[View, tuple[Turned, ...], Undefined | None] = view, (), None
        self._clock, self._pace = self._clock_of(source, 1.0), Pace()
        self._typed = Typed()
        #: the first and the last step of what is played over and over
        self._loop: tuple[int, int] | None = None
        #: the branch that is shown beside it
        self._aside: Aside | None = None
        self._series: tuple[Network, Typed, dict[str, Series]] | None = None
        self._thread = Thread(target=self._drive, name="live run", daemon=True)
        self.failure: Exception | None = None

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    @property
    def view(self) -> View:
        """How what is shown is drawn."""
        return self._view

    def ask(self, command: Command, refuse: Refuse = _ignore, done: Done = _nothing) -> None:
        """Have a command carried out between two steps; ``done`` is called after that, or ``refuse``."""
        self._asked.put((command, refuse, done))

    def change(self, change: Change, refuse: Refuse = _ignore, done: Done = _nothing) -> None:
        """Have another network shown, from between two steps on."""
        self._asked.put((change, refuse, done))

    def inquire(self, what: Callable[[Source], object], refuse: Refuse = _ignore) -> None:
        """Have something done with the source between two steps, which afterwards stands where it stood."""
        self._asked.put((_Inquiry(what), refuse, _nothing))

    def end(self) -> None:
        """Stop, and wait until it has."""
        self._asked.put((None, _ignore, _nothing))
        self._thread.join(5.0)

    @staticmethod
    def _clock_of(source: Source, speed: float) -> Clock:
        given = source.network.dt_given and not source.capabilities.arrives
        return Clock.of(source.network.dt, given, speed)

    def _drive(self) -> None:
        self._clock.start(time.perf_counter())
        self._present()
        while self._attend():
            if self._running:
                try:
                    self._move()
                except Exception as error:
                    self._stand_still(error)
                    self._present()

    def _stand_still(self, error: Exception) -> None:
        """Go no further by itself, and say why."""
        self._playing, self._target = False, None
        _call(self._tell, self._why(error))

    def _why(self, error: Exception) -> str:
        """What is told of something that was raised."""
        if isinstance(error, SourceError):
            return str(error)
        self.failure = error
        _LOG.error("the live run goes on after an error", exc_info=error)
        return f"this failed, and the run is as it was before: {type(error).__name__}: {error}"

    @property
    def _running(self) -> bool:
        return self._playing or self._target is not None

    def _attend(self) -> bool:
        """Carry out what was asked until a step is due; False at the end."""
        while True:
            wait = None
            if self._running:
                due = 0.0 if self._target is not None else max(self._clock.next(), self._pace.due)
                wait = max(0.0, due - time.perf_counter())
            try:
                asked, refuse, done = self._asked.get(timeout=wait) if wait != 0.0 else self._asked.get_nowait()
            except Empty:
                return True
            if asked is None:
                return False
            before = self._source, self._view, self._clock, self._playing, self._ended, self._target
            try:
                self._carry_out(asked, refuse)
            except Exception as error:
                self._source, self._view, self._clock, self._playing, self._ended, self._target = before
                self._present()
                _call(refuse, self._why(error))
            else:
                self._present()
                _call(done)

    def _carry_out(self, asked: Command | Change | _Drawn | _Inquiry, refuse: Refuse) -> None:
        source, now = self._source, time.perf_counter()
        match asked:
            case Play():
                if self._loop is not None:
                    self._loop_back(source.step < self._loop[0])
                elif self._ended:
                    source.restart()
                self._playing, self._ended, self._target = True, False, None
                self._clock.start(now)
            case Pause():
                self._playing, self._target = False, None
            case Speed():
                self._clock.set_speed(asked.value, now)
            case Step():
                self._step(source.number_after(asked.by))
            case Seek():
                self._go(asked.step)
            case Event():
                self._go(self._event(asked.by))
            case Restart():
                source.restart()
                self._stand_elsewhere()
            case Branch() | Switch() | Compare() | Rename() | Forget() | Restore() | Undo():
                self._branch(asked)
            case Draw():
                self.appearance = asked.appearance
                self._redraw(refuse)
            case _Drawn():
                self._take(asked, refuse)
            case _Inquiry():
                asked.what(source)
            case Present():
                pass
            case Loop():
                self._play_over(asked)
            case Unloop():
                self._loop = None
            case Measure():
                self._measure(lambda typed: typed.add(asked.text, source.network))
            case Unmeasure():
                self._measure(lambda typed: typed.without(asked.number))
            case _ if callable(asked):
                self._show_instead(asked, refuse)
            case _:
                source.turn(asked)

    def _branch(self, asked: Branching) -> None:
        """Have the run go on in another branch, or have these be others. Raises SourceError."""
        source = self._source
        match asked:
            case Branch():
                source.branch()
            case Switch():
                source.switch(asked.number, asked.shown)
                self._stand_elsewhere()
            case Compare():
                self._aside = None if asked.number < 0 else Aside(source, asked.number)
            case Rename() if asked.number == source.futures.now:
                source.name = asked.name
            case Rename():
                source.futures = _known(source, asked.number).renamed(asked.number, asked.name)
            case Forget():
                source.futures = _known(source, asked.number).forgotten(asked.number)
            case Restore():
                restored = source.futures.restored()
                if restored is None:
                    raise SourceError("what was deleted is no longer kept")
                source.futures = restored
            case Undo():
                source.take_back(asked.number)
                self._ended = False

    def _stand_elsewhere(self) -> None:
        """What was gone to, and played over and over, is of no concern any more."""
        self._target, self._ended, self._loop = None, False, None
        self._clock.start(time.perf_counter())

    def _show_instead(self, change: Change, refuse: Refuse) -> None:
        """Show another network, or another view of this one."""
        source = self._source
        self._source, self._view = change(source)
        if self._source is not source:
            self._loop = None
            self._typed = self._typed.on(self._source.network)
            self._clock = self._clock_of(self._source, self._clock.speed)
            self._clock.start(time.perf_counter())
            self._ended, self._target = False, None
        self._redraw(refuse)

    def _play_over(self, asked: Loop) -> None:
        """Play these steps over and over. Raises SourceError for such as cannot be gone to."""
        reach = self._source.reach
        if not reach.first <= asked.first < asked.last <= reach.last or self._source.capabilities.arrives:
            raise SourceError(f"steps {asked.first} to {asked.last} cannot be played again")
        self._loop = asked.first, asked.last

    def _loop_back(self, begin: bool = False) -> bool:
        """Go to the first step of what is played over and over, from its last, or to ``begin``; whether it did. Of what
        is not kept any more the rest is played, or nothing."""
        source, loop = self._source, self._loop
        if loop is None or not (begin or source.step >= loop[1]):
            return False
        first = max(loop[0], source.reach.first)
        self._loop = (first, loop[1]) if first < min(loop[1], source.reach.last) else None
        if self._loop is not None:
            source.go(first)
            self._ended = False
        return self._loop is not None

    def _measure(self, change: Callable[[Typed], Typed]) -> None:
        """Have other measures followed. Raises SourceError for what is none, as of a spec that was edited since, and
        where a recording does not tell what one reads."""
        before = self._typed
        try:
            self._typed = change(before)
            self._source.history.follow(self._followed())
        except (SpecError, BodyError, RecordingError) as error:
            self._typed = before
            raise SourceError(str(error)) from None

    def _followed(self) -> dict[str, Series]:
        """All series of the run, made anew where it has others."""
        network, typed = self._source.network, self._typed
        if self._series is None or self._series[0] is not network:
            own = {name: one for name, (_, one) in series_of(network).items()}
        elif self._series[1] is typed:
            return self._series[2]
        else:
            own = {name: one for name, one in self._series[2].items() if name[0] == "e"}
        self._series = network, typed, {**own, **typed.series}
        return self._series[2]

    def _redraw(self, refuse: Refuse) -> None:
        """Make a view in the wanted appearance, if the current one has another, in a thread beside the run."""
        view, wanted = self._view, self.appearance
        if not self._drawing and view.appearance != wanted:
            self._drawing = True

            def draw() -> None:
                try:
                    drawn = _Drawn(view, wanted, view.otherwise(wanted))
                except Exception as error:  # a layout engine, ours or anybody's, may fail
                    drawn = _Drawn(view, wanted, None, str(error))
                self._asked.put((drawn, refuse, _nothing))

            Thread(target=draw, name="live view", daemon=True).start()

    def _take(self, drawn: _Drawn, refuse: Refuse) -> None:
        """Show what was drawn otherwise. Raises SourceError where it could not be, and is still wanted."""
        self._drawing = False
        failed = drawn.view is None and drawn.instead_of is self._view and drawn.wanted == self.appearance
        if failed:
            self.appearance = self._view.appearance
        elif drawn.view is not None and drawn.instead_of is self._view:
            self._view = drawn.view
        self._redraw(refuse)
        if failed:
            raise SourceError(f"the picture cannot be drawn so: {drawn.why}")

    def _step(self, step: int) -> None:
        """To a step nearby, at once, so that of several steps asked for each is made."""
        source, ends, here = self._source, self._source.capabilities.ends, self._source.step
        self._playing, self._target = False, None
        source.go(step if ends else min(step, source.reach.last))
        try:
            while source.step < step and source.advance():
                pass
        except Exception:
            source.go(here)
            raise
        self._ended = ends and source.step == source.reach.last

    def _event(self, by: int) -> int:
        events, here = self._events(), self._source.step
        place = bisect_right(events, here) if by > 0 else bisect_left(events, here) - 1
        if not 0 <= place < len(events):
            raise SourceError("there is no event " + ("after" if by > 0 else "before") + f" step {here}")
        return events[place]

    def _events(self) -> tuple[int, ...]:
        return tuple(sorted({change.at for change in self._source.network.changes}))

    def _go(self, step: int) -> None:
        source = self._source
        self._playing, self._target = False, None
        if source.capabilities.arrives:
            step = min(step, source.reach.last)
        elif step > source.reach.last and not source.capabilities.ends:
            self._target = step
            return
        source.go(step)
        self._ended = source.capabilities.ends and source.step == source.reach.last

    def _move(self) -> None:
        """Make the steps that are due, at most as many as there is time for in a frame, and show the last."""
        begun = time.perf_counter()
        self._pace.begin(begun)
        due = math.inf if self._target is not None else self._clock.due(begun)
        made = 0
        while made < due:
            looped = self._target is None and self._loop_back()
            if not looped and not self._source.advance():
                if self._source.capabilities.arrives:
                    self._clock.start(begun)
                else:
                    self._ended, self._playing = True, False
                break
            made += 1
            if self._target is not None and self._source.step >= self._target:
                self._target = None
                break
            if time.perf_counter() - begun > 1 / FRAMES:
                break
        self._clock.make(made)
        if made or self._ended:
            self._present()

    def _present(self) -> None:
        """Show what is to be seen, where anybody looks on; where that cannot be made, say why, and stand still."""
        try:
            shown = self.shown() if self._wanted() else None
        except Exception as error:
            self._stand_still(error)
        else:
            if shown is not None:
                _call(self._show, shown)

    def shown(self) -> Shown:
        """What is to be seen now; to be called by this thread, or before it begins."""
        source, compared = self._source, self._compared()
        status = Status(
            playing=self._running,
            speed=self._clock.speed,
            ended=self._ended,
            capabilities=source.capabilities,
            parameters=source.parameters,
            fed=source.fed,
            learning=source.learning,
            turned=source.turned,
            events=self._events(),
            appearance=self.appearance,
            backend=source.backend,
            futures=source.futures,
            branch=source.name,
            measures=self._typed.told,
            loop=self._loop,
            compared=None if compared is None else compared.number,
        )
        seen = source.seen()
        glance, reach = self._view.glance(seen), source.reach
        for history in (source.history, *source.futures.histories):
            history.follow(self._followed())
        lost = self._not_finite(glance, status.turned)
        beside = source.body, source.quantities, lost, compared
        return Shown(self._view, seen, glance, reach, status, source.history, *beside)

    def _compared(self) -> Compared | None:
        """What is seen of the branch that is shown beside the run; where it is no more, or cannot go on, none is."""
        try:
            found = None if self._aside is None else self._aside.compared(self._source, self._view)
        except Exception as error:
            found = None
            _call(self._tell, self._why(error))
        if found is None:
            self._aside = None
        return found

    def _not_finite(self, glance: Glance, turned: tuple[Turned, ...]) -> Undefined | None:
        """What is not finite at the step that is shown."""
        view, same, known = self._undefined
        before = known if view is self._view and same == turned else None
        found = undefined_in(self._view, glance, self._source, before)
        self._undefined = self._view, turned, found
        return found
