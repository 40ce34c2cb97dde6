"""Bags as recordings: a bag of ROS 1, or the folder of ``ros2 bag``, that holds a network's topics.

In: a path. Out: a Recording, as of the MCAP files that NeuroVis writes: the network is that of the spec in the bag.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from neurovis_spec.runtime.recording import Recording


class BagFormat:
    """Bags, to be read."""

    name = "bag"
    suffixes = frozenset({".bag", ""})

    def load(self, path: Path) -> Recording:
        """Read a bag; of several runs the last."""
        return self.load_run(path, None)

    def load_run(self, path: Path, run: int | None) -> Recording:
        """Read a run of a bag. Messages that do not fit its network's arrays are left out, with a warning."""
        from dataclasses import replace

        from neurovis_spec.ros.announced import compiled_from
        from neurovis_spec.ros.bags import read_bag
        from neurovis_spec.ros.listening import frame
        from neurovis_spec.ros.play import spec_of
        from neurovis_spec.runtime.arrived import Arrived
        from neurovis_spec.runtime.errors import RecordingError
        from neurovis_spec.runtime.npz_file import recording_errors
        from neurovis_spec.runtime.recording import after_rows, ended
        from neurovis_spec.runtime.rows import KINDS
        from neurovis_spec.runtime.wire import WireError

        bag = read_bag(path)
        found = spec_of(bag)
        if found is None:
            raise RecordingError(f"{path}: it does not say of which network it is: no topic 'spec' is in it")
        text, base = found
        compiled = compiled_from(text, str(path))
        # sensors and pose are skipped: a bag does not say of which body they are, nor which sensors
        kinds = {f"{base}/{kind}": place for place, kind in enumerate(KINDS) if kind not in ("sensors", "pose")}
        arrived, left_out = Arrived(frame(compiled)), 0
        for message in bag.messages():
            kind = kinds.get(message.topic.name)
            if kind is not None:
                try:
                    arrived.take(kind, message.log_time, message.data, message.topic.encoding)
                except (RecordingError, WireError):
                    left_out += 1
        if left_out:
            warnings.warn(f"{path}: {left_out} messages are left out: none of this network's arrays", stacklevel=4)
        with recording_errors(path):
            recording = replace(arrived.recording(path, run), spec=text)
        rows = after_rows(recording.step, recording.weights, len(recording.plastic))
        return ended(recording, replace(rows, set_parameters=recording.set_parameters))
