"""Events of all kinds for random specs: what sets weights, feeds inputs and puts neurons back to their beginning."""

from __future__ import annotations

import random

from random_specs import Plain, Spec


def with_events(spec: Spec, chooser: random.Random) -> Spec:
    """The spec with some more events, within the first nine steps."""
    neurons, connections, inputs = (spec.get(key, {}) for key in ("neurons", "connections", "inputs"))
    assert isinstance(neurons, dict)
    assert isinstance(connections, dict)
    assert isinstance(inputs, dict)
    before = spec.get("events", [])
    assert isinstance(before, list)
    sure = [name for name, body in connections.items() if "random" not in str(body)]  # others may draw nothing
    events: list[Plain] = []
    for name in chooser.sample(sure, min(2, len(sure))):
        weights: list[Plain] = [0.1, -0.2, "2*0.05"]
        weight = chooser.choice(weights)
        events.append({"at": chooser.randint(0, 8), "set": {name: weight}})
    for name, body in inputs.items():
        rows = body.get("values") if isinstance(body, dict) else None
        size = len(rows[0]) if isinstance(rows, list) and isinstance(rows[0], list) else 1
        choices: list[Plain] = [0.3, "0.5/2", [0.1 * i for i in range(size)]]
        events.append({"at": chooser.randint(0, 5), "feed": {name: chooser.choice(choices)}})
        if chooser.random() < 0.7:
            events.append({"at": 7, "feed": {name: None}})
    groups = list(neurons)
    for at in chooser.sample(range(1, 9), 2):
        events.append({"at": at, "reset": chooser.sample(groups, chooser.randint(1, len(groups)))})
    return {**spec, "events": [*before, *chooser.sample(events, chooser.randint(1, len(events)))]}
