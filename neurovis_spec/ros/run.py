"""A network as a node: inputs from topics, a step each 1/rate seconds, outputs, activities and weights to topics.

In: a CompiledNetwork, a Node. Out: messages, and at the end a Summary. Steps are made by the thread that calls ``run``;
parameters are set by the middleware's thread between two of them; once a second another one says how it goes.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from threading import Event, Lock, Thread

import numpy as np

from neurovis_spec.arrays import FloatArray
from neurovis_spec.compiled import CompiledNetwork
from neurovis_spec.compiler.network import Network
from neurovis_spec.compiler.ros_settings import absolute, by_name
from neurovis_spec.interrupts import deferred
from neurovis_spec.ros.accept import ARRAY, STRING
from neurovis_spec.ros.definitions import Definition
from neurovis_spec.ros.diagnostics import Diagnostics
from neurovis_spec.ros.fields import Form
from neurovis_spec.ros.inputs import Inputs
from neurovis_spec.ros.listening import ACTIVITY, SPEC, WEIGHTS, Listening, base_of
from neurovis_spec.ros.middleware import LATCHED, Arrival, MiddlewareError, Node, Parameter, Publisher, Quality, Tell
from neurovis_spec.ros.named import NamedActivities
from neurovis_spec.ros.pace import NO_CLOCK, Clock, Pace, SimulatedClock, SteadyClock
from neurovis_spec.ros.steering import RunSteering
from neurovis_spec.ros.summary import Counts, Summary, Teller
from neurovis_spec.runtime.backend import Ready
from neurovis_spec.runtime.simulation import ParameterError, Simulation
from neurovis_spec.runtime.wire import ArrayForm, WireError, label_of, text_message


@dataclass(frozen=True, slots=True)
class Schedule:
    """How a run goes: ``rate`` steps a second, at most ``steps`` of them or so many ``seconds``, on a ``backend``;
    it begins when its topics have subscribers, at the latest after ``wait`` seconds."""

    rate: float
    steps: int | None = None
    seconds: float | None = None
    wait: float = 0.0
    backend: str | Ready | None = None


def simulation(network: Network, backend: str | Ready | None) -> Simulation:
    """The network, made ready. Its body is what is at the topics, not that of the spec. Raises BackendError."""
    return Simulation(replace(network, body=None), backend)


@dataclass
class _Array:
    """An array of the network's, with its prelude; who listens in this process gets it, too."""

    publisher: Publisher
    listening: Listening | None
    form: ArrayForm

    def step(self, step: int, nanoseconds: int, values: FloatArray) -> None:
        """Send the array of a step."""
        data = self.form.message(step, nanoseconds / 1e9, values)
        self.publisher.publish(data)
        if self.listening is not None:
            arrival = Arrival(data, time.time_ns(), nanoseconds, self.publisher.type)
            self.listening.put(self.publisher.topic, arrival)


@dataclass
class _Output:
    """An output. What is not finite is not sent: its safe value is, where it has one."""

    publisher: Publisher
    form: Form
    name: str
    safe: FloatArray | None
    withheld: int = 0

    def put(self, values: FloatArray, nanoseconds: int) -> None:
        """The output of a step."""
        if np.isfinite(values).all():
            self.publisher.publish(self.form.fill(values, nanoseconds))
        else:
            self.withheld += 1
            self.end(nanoseconds)

    def end(self, nanoseconds: int) -> None:
        """The safe values, where there are some."""
        if self.safe is not None:
            self.publisher.publish(self.form.fill(self.safe, nanoseconds))


class NodeRun:
    """A network that runs as a node. What it says goes to ``tell``, and what it sends and receives to ``listening``."""

    def __init__(
        self,
        compiled: CompiledNetwork,
        node: Node,
        schedule: Schedule,
        tell: Tell,
        listening: Listening | None = None,
    ) -> None:
        self._compiled, self.network, self.node, self._schedule = compiled, compiled.network, node, schedule
        self._tell, self._teller, self._listening = tell, Teller(tell), listening
        self._lock, self._end = Lock(), Event()
        self._simulation = simulation(self.network, schedule.backend)
        self._clock: Clock = SimulatedClock(node.now) if node.simulated else SteadyClock()
        self._pace = Pace(self._clock, schedule.rate)
        self._begun, self._over = time.monotonic(), math.inf
        self.why: str | None = None
        try:
            self._inputs = self._subscribe()
            self._publish()
        except WireError as error:
            raise MiddlewareError(str(error)) from None
        self._steering = RunSteering(self._simulation, self._lock)
        if listening is not None and listening.source is not None:
            listening.source.steer(self._steering)
        self._offer()
        self._diagnostics = Diagnostics.of(node, f"{node.name.lstrip('/')}: network")

    # ---- what there is -----------------------------------------------------------------------------------------

    def _subscribe(self) -> Inputs:
        node, settings = self.node, self.network.ros
        wanted = [replace(one, topic=node.resolved(absolute(one.topic, node.name))) for one in settings.subscribe]
        definitions = {one.type: Definition.parse(one.type, node.definition(one.type)) for one in wanted}
        sizes = {entry.name: entry.size for entry in self.network.inputs}
        inputs = Inputs.of(wanted, sizes, definitions, node.encoding, self._clock.now, self._teller)
        quality = Quality("offered", "volatile", 10)
        for topic in inputs.topics:
            if self._listening is not None:
                self._listening.add(topic.topic, topic.type)
                topic.heard = partial(self._listening.put, topic.topic)
            node.subscription(topic.topic, topic.type, quality, topic.take)
        return inputs

    def _publish(self) -> None:
        node, network = self.node, self.network
        settings = network.ros
        quality = Quality(settings.reliability, settings.durability, settings.depth_at(self._schedule.rate))
        base = base_of(self._compiled)
        self._activity = self._array(f"{base}/{ACTIVITY}", len(network.neurons), quality)
        changing = len(network.changing)
        self._weights = self._array(f"{base}/{WEIGHTS}", changing, quality) if changing else None
        wanted = by_name(settings.values, len(network.neurons))
        self._named = (
            NamedActivities.of(node, f"{base}/values", network.name, network.neurons.names, wanted, quality)
            if wanted
            else None
        )
        sizes = {output.name: output.size for output in network.outputs}
        self._outputs = []
        for one in settings.publish:
            size = sizes[one.output]
            form = Form(Definition.parse(one.type, node.definition(one.type)), one.field, size, node.encoding)
            publisher = node.publisher(absolute(one.topic, node.name), one.type, quality)
            safe = None if one.safe is None else np.full(size, one.safe)
            self._outputs.append(_Output(publisher, form, one.output, safe))
        self._spec = node.publisher(f"{base}/{SPEC}", STRING, LATCHED)
        self._spec.publish(text_message(self._compiled.text(), node.encoding))

    def _array(self, topic: str, size: int, quality: Quality) -> _Array:
        form = ArrayForm.of(label_of(self.network.hash), size, self.node.encoding)
        return _Array(self.node.publisher(topic, ARRAY, quality), self._listening, form)

    def _offer(self) -> None:
        network, spec = self.network, self._compiled.spec
        parameters = []
        for name, value in self._steering.parameters.items():
            slot = network.settable.slots[network.settable.index[name]]
            low, high = (bound if isinstance(bound, float) and np.isfinite(bound) else None
                         for bound in (slot.low, slot.high))  # fmt: skip
            written = spec.parameters.get(name)
            parameters.append(Parameter(name, value, low, high, "" if written is None else written.about))
        self.node.declare(parameters, self._set)

    def _set(self, values: Mapping[str, float]) -> str | None:
        """Set parameters between two steps; gives why not."""
        with self._lock:
            try:
                self._simulation.set(values)
            except ParameterError as error:
                return str(error)
        return None

    # ---- the run -----------------------------------------------------------------------------------------------

    def wait(self, stopped: Callable[[], bool]) -> None:
        """Wait for subscribers, as long as the schedule says."""
        arrays = [self._activity, *([self._weights] if self._weights else [])]
        publishers = [*(one.publisher for one in arrays), *(one.publisher for one in self._outputs)]
        deadline = time.monotonic() + self._schedule.wait
        while time.monotonic() < deadline and not stopped() and not self.node.ended:
            if all(publisher.subscribers for publisher in publishers):
                return
            time.sleep(0.01)

    def run(self, asked: Callable[[], bool]) -> None:
        """Make the steps, until ``asked`` says to end, or the schedule does; at the end the outputs are safe."""
        schedule, step = self._schedule, 0
        self._begun = begun = time.monotonic()

        def stopped() -> bool:
            over = schedule.seconds is not None and time.monotonic() - begun >= schedule.seconds
            return over or asked() or self.node.ended

        watch = Thread(target=self._watch, name="ros diagnostics", daemon=True)
        watch.start()
        try:
            going = self._pace.begin(stopped, lambda: self._tell(NO_CLOCK))
            while going and (schedule.steps is None or step < schedule.steps) and self._pace.wait(step, stopped):
                going = self._step(step)
                step += 1
        finally:
            with deferred():  # who presses Ctrl-C twice must not lose what is safe
                self._make_safe()
                for topic in self._inputs.topics:
                    topic.end()
                self._over = time.monotonic()
                self._end.set()
                watch.join(2.0)
                self._tell_of_inputs()
                self._teller.rest()

    def _make_safe(self) -> None:
        """Send the safe outputs, each whatever becomes of the others."""
        now = self.node.now()
        for output in self._outputs:
            try:
                output.end(now)
            except Exception as error:
                self._tell(f"the output '{output.name}' is not safe: {error}")

    def _step(self, step: int) -> bool:
        """Make a step and publish it; False where an input that has fallen silent ends the run."""
        inputs = self._inputs.values(self._clock.now())
        inputs |= {
            name: np.array(values) if len(values) > 1 else values[0] for name, values in self._steering.fed.items()
        }
        for one in self._inputs.silent:
            if one.on_timeout == "stop":
                self.why = f"the input '{one.input}' has fallen silent: no message on {one.topic} for {one.timeout:g} s"
                return False
        run, now = self._simulation, self.node.now()
        with self._lock:
            weights = run.weights if self._weights is not None else None
            try:
                outputs = run.step(inputs)
            except ParameterError as error:  # the step was made, without the events that cannot be
                self._tell(str(error))
                outputs = run.outputs
            activity = run.activity
        for output in self._outputs:
            output.put(np.atleast_1d(outputs[output.name]), now)
        self._activity.step(step, now, activity)
        if self._named is not None:
            self._named.step(now, activity)
        if self._weights is not None and weights is not None:
            self._weights.step(step, now, weights)
        return True

    # ---- how it goes -------------------------------------------------------------------------------------------

    def _watch(self) -> None:
        while not self._end.wait(1.0):
            try:
                self.node.follow(self._steering.parameters)
                self._teller.look()
                self._tell_of_inputs()
                self._diagnostics.say(self.summary(), [one.input for one in self._inputs.silent], self._schedule.rate)
            except Exception as error:
                self._tell(f"diagnostics: {error}")

    def _tell_of_inputs(self) -> None:
        for line in self._inputs.news():
            self._tell(line)

    def summary(self) -> Summary:
        """How it has gone so far. What was withheld of outputs counts as not finite."""
        listening = self._listening
        heard = {} if listening is None else listening.counts
        topics = {name: heard.get(name, Counts()) for name in (ACTIVITY, WEIGHTS)}
        for topic in self._inputs.topics:
            kept = heard.get(topic.topic, Counts())
            topics[topic.topic] = replace(topic.counts, recorded=kept.recorded, lost=kept.lost)
        for output in self._outputs:
            counts = topics.get(output.publisher.topic, Counts())
            topics[output.publisher.topic] = replace(counts, not_finite=counts.not_finite + output.withheld)
        shown, skipped = (0, 0) if listening is None else listening.shown
        return Summary(
            network=self.network.name,
            hash=self.network.hash,
            ros=self.node.ros,
            seconds=min(time.monotonic(), self._over) - self._begun,
            steps=self._simulation.k,
            late=self._pace.late,
            reconnects=self.node.reconnects,
            shown=shown,
            skipped=skipped,
            files=() if listening is None else listening.paths,
            topics=topics,
        )
