"""What lies beyond the steps of a run: delays after which nothing arrives, episodes that do not end.

In: what a spec without errors became. Out: a warning at each, where the spec says how many steps a run has
(``time.steps``). Events are checked in ``event_warnings``.
"""

from __future__ import annotations

from neurovis_spec.compiler.checks.compiled import Compiled
from neurovis_spec.compiler.limits import plural
from neurovis_spec.diagnostics import Findings


def check_beyond(compiled: Compiled, findings: Findings) -> None:
    """Warn of delays and episodes that are too long for a run of the spec's own length."""
    time, steps = compiled.spec.time, compiled.network.steps
    if time is None or time.steps is None:
        return
    hint = "shorten it, or lengthen the run: time: {{steps: {}}}"
    episode = compiled.network.episode
    if time.episode is not None and episode is not None and episode > steps:
        message = f"an episode of {plural(episode, 'step')} does not end in a run of {steps} ('steps')"
        findings.warning("beyond-steps", time.episode.span, message, hint.format(episode))
    for key, body, bundles in compiled.entries():
        late = [bundle for bundle in bundles if (bundle.delays >= steps).any()]
        if not late:
            continue
        longest = max(int(bundle.delays.max()) for bundle in late)
        span = key.span if body.delay is None or body.edges is not None else body.delay.span
        message = f"after a delay of {plural(longest, 'step')} nothing arrives in a run of {steps} ('steps')"
        findings.warning("beyond-steps", span, message, hint.format(longest + 1))
