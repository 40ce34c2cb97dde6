"""The main jobs, stage by stage: the paper's first use case learns its target, and its second learns to walk.

In: ``specs/cpg_rbf.yaml``, or with the argument ``walk`` ``specs/walk/walk.yaml``. Out: files in ``demo/``, and a line
for each stage: what, how long, which file. Every stage is a command that can be typed as well. Run by ``make demo`` and
``make walk``.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter

#: what, the file it makes, the command
Stage = tuple[str, str, str]


@dataclass(frozen=True)
class Job:
    """Stages, what is said of their result, what there is to open, what to try next."""

    stages: tuple[Stage, ...]
    learned: Callable[[], str]
    files: tuple[str, ...]
    live: str


def main(job: Job) -> int:
    """Run the stages; 1 at the first that fails."""
    Path("demo").mkdir(exist_ok=True)
    for what, file, command in job.stages:
        begun = perf_counter()
        done = subprocess.run([sys.executable, "-m", "neurovis_spec", *command.split()], capture_output=True, text=True)
        seconds = perf_counter() - begun
        if done.returncode:
            print(f"neurovis {command}\n{done.stdout}{done.stderr}", file=sys.stderr)
            return 1
        if _prints(command):
            Path(file).write_text(done.stdout, encoding="utf-8")
        print(f"{what:<26}{seconds:5.1f} s   {_size(file) if file else done.stdout.strip()}", flush=True)
    print(job.learned())
    print("\nOpen in a browser:", *(f"  {line}" for line in job.files), sep="\n")
    print("\nThe same by hand, in the checkout (neurovis is .venv/bin/neurovis):")
    for _, file, command in job.stages:
        print(f"  neurovis {command}" + (f" > {file}" if _prints(command) else ""))
    print("\nThe same while it runs, to be turned by hand, in the browser:")
    print(f"  {job.live}")
    return 0


def _prints(command: str) -> bool:
    """Whether the file of a stage is what the command prints."""
    return command.startswith("inspect")


def _size(file: str) -> str:
    return f"{file} ({Path(file).stat().st_size / 1024:,.0f} KiB)"


def _error() -> str:
    """How far the output is from its target, in the first period and in the last."""
    import numpy as np

    import neurovis_spec as nv

    run = nv.load("demo/run.npz")
    error = run["T"] - run["O"]
    first, last = (float(np.sqrt(np.mean(part**2))) for part in (error[:129], error[-129:]))
    return f"the error of O (RMS): {first:.3f} in the first period, {last:.4f} in the last"


def _way() -> str:
    """How far the robot comes in an episode, at first and at last."""
    import neurovis_spec as nv

    run = nv.load("demo/walk.npz")
    assert run.sensors is not None
    way = run.sensors[62::63, list(run.sensor_names).index("torso_x")]
    first, last = float(way[:10].mean()), float(way[-10:].mean())
    return f"the way in an episode of 3.15 s: {first:.2f} m in the first ten, {last:.2f} m in the last ten"


SPEC, WALK = "specs/cpg_rbf.yaml", "specs/walk/walk.yaml"
LEARN = Job(
    (
        ("check the spec", "", f"validate {SPEC}"),
        ("compile it", "demo/network.txt", f"inspect {SPEC}"),
        ("lay it out", "demo/layout.yaml", f"layout {SPEC} -o demo/layout.yaml"),
        ("run 12,000 steps", "demo/run.npz", f"run {SPEC} --steps 12000 -o demo/run.npz"),
        ("draw step 90", "demo/learning.svg", f"render {SPEC} --recording demo/run.npz --step 90 -o demo/learning.svg"),
        ("draw the last step", "demo/learned.svg", f"render {SPEC} --recording demo/run.npz -o demo/learned.svg"),
        ("the same as PNG", "demo/learned.png", f"render {SPEC} --recording demo/run.npz -o demo/learned.png"),
        ("draw two periods, moving", "demo/moving.svg",
         f"animate {SPEC} --recording demo/run.npz --steps 257 -o demo/moving.svg"),
    ),
    _error,
    (
        "demo/moving.svg    the first two periods: the rhythm runs, and what learns glows",
        "demo/learning.svg  step 90, in the midst of it; demo/learned.svg, what was learned (also as .png)",
    ),
    f".venv/bin/pip install '.[live]' && .venv/bin/neurovis live {SPEC} --open",
)  # fmt: skip
LEARN_TO_WALK = Job(
    (
        ("check the spec", "", f"validate {WALK}"),
        ("learn, 250 episodes", "demo/walk.npz", f"run {WALK} -o demo/walk.npz"),
        ("draw what was learned", "demo/walk_weights.svg",
         f"render {WALK} --recording demo/walk.npz --view network --view weights -o demo/walk_weights.svg"),
        ("the first two episodes", "demo/walk_first.svg",
         f"animate {WALK} --recording demo/walk.npz --steps 126 -o demo/walk_first.svg"),
        ("the last two episodes", "demo/walk_last.svg",
         f"animate {WALK} --recording demo/walk.npz --from 15624 --steps 126 -o demo/walk_last.svg"),
    ),
    _way,
    (
        "demo/walk_first.svg    the hexapod beside its network: it does not know yet what its legs are for",
        "demo/walk_last.svg     250 episodes later it walks",
        "demo/walk_weights.svg  the weights on the way there",
    ),
    f".venv/bin/pip install '.[live,sim]' && .venv/bin/neurovis live {WALK} --open",
)  # fmt: skip

if __name__ == "__main__":
    if sys.argv[1:] not in ([], ["walk"]):
        sys.exit("usage: demo.py [walk]")
    sys.exit(main(LEARN_TO_WALK if sys.argv[1:] else LEARN))
