"""The simulator as a source: a run that can go back to a step of its past and go on from there differently.

In: a Simulation. Out: a Source. A turn is a change that a user makes on the way: a parameter set, an input fed, a
neuron clamped or lesioned (``turns``). Every so many steps, and at every turn, the state is kept; a step of the past is
made again from the state before it, bit for bit, with the turns that were taken then. Where the network has a body
whose state cannot be kept there is no going back.
"""

from __future__ import annotations

import warnings
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import copy
from dataclasses import replace
from operator import attrgetter

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.body import BodyError
from neurovis_spec.compiler.network import Network
from neurovis_spec.live.beside import Before, Beside
from neurovis_spec.live.futures import Future, Futures
from neurovis_spec.live.history import Ring
from neurovis_spec.live.past import EVERY, ROOM, Kept, Past
from neurovis_spec.live.source import Capabilities, Reach, Seen, SourceError, drawn, recalled
from neurovis_spec.live.turns import (
    TURNS,
    Feed,
    Lesion,
    Mend,
    Set,
    Turn,
    Turned,
    Weigh,
    carried_out,
    feed,
    is_finite,
    opposite,
    rules,
    taken,
    turn,
    without_drags,
)
from neurovis_spec.runtime.columns import columns_of
from neurovis_spec.runtime.quantities import Quantities
from neurovis_spec.runtime.recording import Snapshot
from neurovis_spec.runtime.rows import After
from neurovis_spec.runtime.simulation import ParameterError, Simulation
from neurovis_spec.runtime.state import State
from neurovis_spec.scene.ends import SetEnds
from neurovis_spec.scene.fading import Fading
from neurovis_spec.scene.shown_states import ShownStates
from neurovis_spec.scene.signals import Signals


class SimulatedSource:
    """A network that runs; it stands at the first step to be computed: step 0, or that of ``begin``, a state in which
    ``turned`` has had its effect and inputs are ``fed``. ``origin`` is where it begins anew."""

    capabilities = Capabilities(TURNS | {"branch", "switch", "rename", "compare", "forget", "restore", "undo"})

    def __init__(
        self,
        simulation: Simulation,
        begin: State | None = None,
        turned: Sequence[Turned] = (),
        fed: Mapping[str, tuple[float, ...]] | None = None,
        origin: State | None = None,
        room: int = ROOM,
    ) -> None:
        self.network: Network = simulation.network
        self._rules = rules(self.network)
        self._all_learn: Mapping[str, bool | None] = {rule.connections: True for rule in self._rules}
        self._simulation, self._room = simulation, room
        self._probe = columns_of(self.network).probe
        self._shown, self._signals = ShownStates(self.network), Signals(self.network)
        self._ends, self._every = SetEnds(self.network), Quantities(self.network)
        self._beside = Beside(self.network, len(self._every))
        #: those of the current step
        self.quantities: FloatArray | None = None
        self._signals.follow(simulation)
        self._origin = simulation.state() if origin is None else origin
        #: the other futures of this run
        self.futures, self.name = Futures(), ""
        #: how many turns were taken
        self._taken = 1 + max((entry.number for entry in turned), default=-1)
        self._begin(self._origin if begin is None else begin, turned, fed or {})
        pose, actuators = self._seen.snapshot.pose, tuple(simulation.actuators)
        self.body = drawn(simulation.skeleton, tuple(simulation.sensors), pose, actuators)

    def _begin(self, state: State, turned: Sequence[Turned], fed: Mapping[str, tuple[float, ...]]) -> None:
        self._past = Past(self._room)
        quantities = len(self._every) + len(self._beside)
        self.history = Ring(len(self.network.neurons), len(self.network.connections), quantities)
        self._fading = Fading(self.network)
        self._fed, self._turned = dict(fed), list(turned)
        #: what was true after the current step, where events have changed it since
        self._ended: After | None = None
        self._listed: tuple[list[Turned], tuple[Turned, ...]] = ([], ())
        self._started = self._last = state.k
        #: the step behind which it was left before it was gone to, and the turn that it was left by
        self._by: tuple[int, int | None] = -1, None
        self._stuck = False
        self._simulation.restore(state)
        self._keep(self._kept())
        self._seen = self._make(None)

    @property
    def step(self) -> int:
        """The current step."""
        return self._seen.snapshot.step

    @property
    def reach(self) -> Reach:
        """The steps that it can go to."""
        return Reach(min(self.step, self._first_seen) if len(self._past) else self.step, self._last)

    @property
    def _first_seen(self) -> int:
        """The first step of the past: where the run began, if that is still kept, else the second step that is: a
        picture needs the weights of the step before."""
        first = self._past.first
        return first if first == self._started else first + 1

    @property
    def turned(self) -> tuple[Turned, ...]:
        """The turns that were taken up to the current step, in order."""
        until = self._turned[: bisect_right(self._turned, self.step, key=attrgetter("step"))]
        if len(self._listed[0]) != len(until):
            self._listed = until, without_drags(until)
        return self._listed[1]

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters that can be set, as they are now."""
        now = self._simulation.parameters
        return {name: value for name, value in now.items() if name not in self.network.structural}

    @property
    def fed(self) -> Mapping[str, tuple[float, ...]]:
        """What is fed to inputs, by hand and by events."""
        return {**self._simulation.fed, **self._fed}

    @property
    def learning(self) -> Mapping[str, bool | None]:
        """Whether connections learn, by the reference that names them; None where only some of these do."""
        stopped = self._simulation.stopped
        if not stopped.any():
            return self._all_learn
        return carried_out(self._rules, stopped)

    @property
    def backend(self) -> str:
        """The name of the backend that makes its steps."""
        return self._simulation.backend

    def leave(self) -> State:
        """The state from which the current step is computed, or where none before it is kept, the next one. The source
        must not be used afterwards, but for ``stay``. Raises BodyError where the body cannot be kept."""
        run, step = self._simulation, self.step
        kept = self._past.before(step)
        if kept is not None:
            self._take(kept)
            while run.k < step:
                self._make(None)
        return run.state()

    def stay(self) -> None:
        """After ``leave``, also where it has failed, go on behind the current step all the same."""
        if self._simulation.k != self.step + 1:
            with self._whole():
                self._retake()

    def seen(self) -> Seen:
        """What a picture of the current step is made from."""
        return self._seen

    def after(self) -> After:
        """What is true after the current step, with what was turned at it; weights of all connections (m,)."""
        turned = self._turned[bisect_left(self._turned, self.step, key=attrgetter("step")) :]
        by_hand = any(
            entry.step == self.step and isinstance(entry.turn, Set | Lesion | Mend | Weigh) for entry in turned
        )
        return self._simulation.after() if by_hand or self._ended is None else self._ended

    def advance(self) -> bool:
        """Go on by one step. Raises SourceError where the body cannot, and then it stands where it stood."""
        self._check_going()
        with self._whole():
            self._next(self._seen.snapshot)
        return True

    @contextmanager
    def _whole(self) -> Iterator[None]:
        """Whatever fails in this block, the source stands where it stood. Its attributes are replaced, and of what they
        hold nothing is taken away before all that can fail is done. Raises SourceError for what the body cannot do."""
        before = vars(self).copy()
        try:
            yield
        except Exception as error:
            vars(self).update(before)
            try:
                self._stuck = not self._retake()
            except Exception:  # nothing leads back
                self._stuck = True
            if isinstance(error, BodyError):
                raise SourceError(str(error)) from None
            raise

    def _check_going(self) -> None:
        if self._stuck:
            raise SourceError("the body cannot go on from here: begin anew")

    def _retake(self) -> bool:
        """Be again behind the current step, wherever the simulation is; False where nothing before it is kept."""
        kept, run = self._past.before(self.step + 1), self._simulation
        if kept is not None:
            self._take(kept)
            while run.k <= self.step:
                self._make(None)
        return kept is not None

    def _next(self, before: Snapshot | None) -> None:
        """Compute a step; ``before`` is what was seen of the one before it."""
        self._seen = self._make(before)
        self._last = max(self._last, self.step)
        known = self._past.at(self._simulation.k)
        if known is not None:  # whatever was turned here is turned again
            self._take(known)
        elif self._simulation.k % EVERY == 0:
            self._keep(self._kept())
        place = bisect_right(self._turned, self.step, key=attrgetter("step"))
        if place and self._turned[place - 1].step == self.step:
            self._seen = self._turned_seen()

    def number_after(self, by: int) -> int:
        """The step so many further on, or back."""
        return max(self.reach.first, self.step + by)

    def go(self, step: int) -> None:
        """Go to a step within reach, to those of the past by making them again. Raises SourceError, also where the body
        cannot do again what it has done; then it stands where it stood."""
        reach = self.reach
        if not reach.first <= step <= reach.last:
            raise SourceError(f"step {step} is out of reach: the past goes from step {reach.first} to {reach.last}")
        if step == self.step:
            return
        self._check_going()
        with self._whole():
            self._make_up_to(step, again=step < self.step)

    def _make_up_to(self, step: int, again: bool) -> None:
        """Make the steps up to one, from where the run is, or, ``again`` or where that is nearer, from the latest state
        before it that is kept."""
        kept = self._past.before(step - 1) or self._past.before(step)
        if kept is not None and (again or kept.state.k > self._simulation.k):
            self._take(kept)
            self._next(None)
        while self.step < step:
            self._next(self._seen.snapshot)

    def restart(self) -> None:
        """Begin anew, at step 0; what was is another future. Raises SourceError where the body cannot."""
        with self._whole():
            before = self._left(-1).bounded()
            self._begin(self._origin, (), {})
            self.futures, self.name = before, ""

    def recall(self, steps: int) -> list[Seen]:
        """What was seen of the last steps."""
        with self._whole():
            return recalled(self, steps)

    def past(self) -> Futures:
        """All that it has done, as another future of a run that begins anew."""
        return self._left(-1).bounded() if self._last > 0 else self.futures

    def _left(self, at: int, by: int | None = None, whole: bool = False) -> Futures:
        """The futures with what came after this step among them, left ``by`` a turn of this number, if anything did
        that can be gone to. A ``whole`` run is left as it is, also where it has made no step since: it may be gone
        back to."""
        if (self._last <= at and not whole) or not len(self._past):
            return self.futures
        kept, history = self._past.after(at), self.history.after(at)
        turned = tuple(self._turned)
        left = Future(0, at, self._last, self._started, turned, kept, history, name=self.name, by=by)
        return self.futures.leave(left)

    def switch(self, number: int, step: int | None = None) -> None:
        """Go to another future, to a step, by default that which is shown, or to its last; of what is too much then,
        what has no room by itself is forgotten, and the oldest. Raises SourceError, also where the body cannot do again
        what it has done."""
        path = self.futures.path(number)
        step = self.step if step is None else step
        if not path:
            raise SourceError("this branch is no longer kept")
        if path[-1].older:
            raise SourceError("this branch is of an older spec: its curves can be shown, but it cannot go on")
        self._check_going()
        with self._whole():
            self._past, self.history = self._past.copy(), self.history.copy()
            for future in path:
                self._take_up(future, step)
            self.futures = self.futures.bounded()

    def twin(self, number: int) -> SimulatedSource:
        """Another run of the same network, which is in a future, by its number, at the step that is shown or at its
        last, and goes by itself; what it goes through is noted here no more. Raises SourceError."""
        made = SimulatedSource(Simulation(self.network, self.backend), origin=self._origin)
        made._past, made.futures, made._seen = self._past.copy(), self.futures, self._seen
        made._turned, made._started, made._last = list(self._turned), self._started, self._last
        made._fed, made._taken = dict(self._fed), self._taken
        made.switch(number)
        return made

    def _take_up(self, future: Future, step: int) -> None:
        """Go on as in a future that branches off from the run as it goes."""
        at = future.at if future.at >= self._started else -1
        # what has all its states needs none of those before them
        if self.reach.first <= at or (at >= 0 and not future.kept):
            self.go(min(self.step, at))
        others = self._left(at, self._by[1] if self._by[0] == at else None, whole=True)
        if at < 0:
            self._begin(self._origin, (), {})
        self.futures = others
        self._past.cut(at)
        self.history.cut(at)
        self._go_on(future)
        self._started = future.started
        self._make_up_to(max(self._first_seen, min(step, self._last)), again=True)

    def branch(self) -> None:
        """Have the run go on differently from here; what came after is another future."""
        self._part()

    def _leave(self, by: int | None = None) -> None:
        """What came after the current step is another future, with the name that the run had."""
        before = self.futures.made
        self.futures = self._left(self.step, by).bounded()
        if self.futures.made > before:
            self.name, self._by = "", (-1, None)

    def _part(self, by: int | None = None) -> None:
        """``branch``, or what a turn, ``by`` its number, does before it has its effect."""
        self._leave(by)
        self._past.cut(self._simulation.k)
        self.history.cut(self.step)
        self._last = self.step
        self._turned = [entry for entry in self._turned if entry.step <= self.step]
        self._listed = [], ()

    def turn(self, what: Turn) -> None:
        """Take a turn, from the next step on. Raises SourceError."""
        self._check_going()
        with self._whole():
            back = self._opposite(what)
            refused = self._turn(what)
            if not refused:
                kept = self._kept()
                self._part(by=self._taken)
                self._keep(kept)
                self._turned = taken(self._turned, Turned(self.step, what, self._taken, back))
                self._taken += 1
                self._seen = self._turned_seen()
        if refused:
            raise SourceError(refused)

    def number_behind(self, other: SimulatedSource) -> None:
        """Number turns behind all those of another source, whose branches this one takes over."""
        self._taken = max(self._taken, other._taken)

    def take_back(self, number: int) -> None:
        """Take a turn back, by its number: at the step at which it was taken, or before that, as though it had not
        been, with what came after it without it; later by its opposite. Raises SourceError."""
        entry = next((entry for entry in without_drags(self._turned) if entry.number == number), None)
        if entry is None:
            raise SourceError("what was turned is no part of this branch")
        is_later = entry.since is not None or entry.step < self.step or self._past.before(entry.step) is None
        if is_later and entry.back is not None:
            if not is_finite(entry.back):
                raise SourceError("what was before is not one finite number: go back to where it was turned")
            self.turn(entry.back)
            return
        self._check_going()
        with self._whole():
            self._past, self.history = self._past.copy(), self.history.copy()
            if self.step != entry.step:
                self._make_up_to(entry.step, again=True)
            self._unturn(entry)

    def _unturn(self, one: Turned) -> None:
        """Be at the current step as though a turn had not been taken here."""
        step, before = self.step, self.futures
        rest = [entry for entry in self._turned if entry.step <= step and entry.number != one.number]
        self._leave()
        self._past.cut(step)
        self.history.cut(step)
        self._turned, self._last, self._listed = rest, step, ([], ())
        self._make_up_to(step, again=True)
        here = [entry.turn for entry in rest if entry.step == step]
        for what in here:
            refused = self._turn(what)
            if refused:  # it needs what is taken back
                raise SourceError(refused)
        if here:
            self._keep(self._kept())
            self._seen = self._turned_seen()
        without = before.left_by(one.number, step, rest)
        if without is not None and self.futures.path(without.number):
            self._go_on(without)

    def _go_on(self, future: Future) -> None:
        """Have the states, the turns and the history of a future follow those of the run until where it branched
        off."""
        self.futures = self.futures.taken_up(future.number)
        for kept in future.kept:
            self._past.keep(kept)
        assert isinstance(future.history, Ring)
        self.history.go_on(future.history)
        self.name, self._by = future.name, (future.at, future.by)
        self._turned, self._last, self._listed = list(future.turned), future.last, ([], ())

    def _opposite(self, what: Turn) -> Turn:
        """What takes a turn back that is about to be taken."""
        weight = None
        if isinstance(what, Weigh):
            weight = self._simulation.weight_of(what.connections)
        return opposite(what, self._turned, self.parameters, self.fed, weight)

    def _turn(self, what: Turn) -> str:
        """Apply a turn; why it cannot be, and then nothing has changed."""
        try:
            if isinstance(what, Feed):
                self._fed = feed(self._simulation, self._fed, what)
            else:
                turn(self._simulation, what)
        except (ValueError, KeyError) as error:
            return str(error)
        if isinstance(what, Set):
            self._weigh_again()
        return ""

    def _weigh_again(self) -> None:
        """Of what is turned at this step weights come last. Raises SourceError, and then something has changed."""
        for entry in self._turned[bisect_left(self._turned, self.step, key=attrgetter("step")) :]:
            if entry.step == self.step and isinstance(entry.turn, Weigh):
                try:
                    turn(self._simulation, entry.turn)
                except ParameterError as error:
                    raise SourceError(str(error)) from None

    def _turned_seen(self) -> Seen:
        """What is seen of this step after a turn: what is lesioned and clamped is that of the next one."""
        neurons, connections = self._simulation.lesioned
        return replace(
            self._seen, lesioned_neurons=neurons, lesioned_connections=connections, clamped=self._simulation.held
        )

    def _kept(self) -> Kept | None:
        """All that the run needs to go on from here; None with a body that cannot be kept."""
        try:
            return Kept(self._simulation.state(), self._fed, copy(self._fading))
        except BodyError:
            return None

    def _keep(self, kept: Kept | None) -> None:
        if kept is None:
            self._past = Past(self._room)
        else:
            self._past.keep(kept)

    def _take(self, kept: Kept) -> None:
        self._simulation.restore(kept.state)
        self._fed, self._fading = dict(kept.fed), copy(kept.fading)

    def _make(self, before: Snapshot | None) -> Seen:
        """Compute a step; ``before`` is what was seen of the one before it."""
        run = self._simulation
        step, weights, lesioned, held = run.k, run.connection_weights, run.lesioned, run.held
        pose, ends = run.pose, self._ends.of_run(run)
        held_before = Before(run.slots, lesioned[0], _middle(run, pose))
        try:
            run.step({name: values if len(values) > 1 else values[0] for name, values in self._fed.items()})
        except ParameterError as error:  # what events set does not go with what was turned: the step was made without
            warnings.warn(str(error), RuntimeWarning, stacklevel=2)
        self._ended = run.ended
        previous = before.weights if before is not None and before.step == step - 1 else None
        activity, shown = run.activity, self._shown.of_run(run)
        self.quantities = np.concatenate([run.looked(self._every), self._beside.now(run, held_before)])
        self.history.note(step, activity if shown is None else shown, weights, self.quantities)
        sent, seen = self._signals.of_run(run), None
        if self._fading:
            seen = self._fading.follow(np.array([step]), activity[None], None if sent is None else sent[None])
            sent = self._fading.sent if self._fading.sends else sent
        told = (seen, pose, run.sensed, shown, sent, ends, _told(run))
        snapshot = Snapshot(step, activity, weights, previous, *told)
        return Seen(snapshot, *lesioned, held, run.probed(self._probe))


def _told(run: Simulation) -> FloatArray | None:
    """What the body is told behind a step; None without a body, where its episode ends there, and where that is no
    finite number, so that the run ends there."""
    try:
        return run.commands
    except BodyError:
        return None


def _middle(run: Simulation, pose: FloatArray | None) -> FloatArray:
    """Where the middle of the body is, x and y in metres, NaN where there is none."""
    if pose is None or run.skeleton is None or not run.skeleton.points:
        return np.full(2, np.nan)
    return pose[3 * run.skeleton.middle :][:2]
