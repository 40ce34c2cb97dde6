"""The main job, stage by stage: the network of the paper's first use case learns its target, and is drawn.

In: ``specs/cpg_rbf.yaml``. Out: the files in ``demo/``, and a line for each stage: what, how long, which file. Every
stage is a command that can be typed as well. Run by ``make demo``.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from time import perf_counter

SPEC = "specs/cpg_rbf.yaml"
#: what, the file it makes, the command
STAGES = (
    ("check the spec", "", f"validate {SPEC}"),
    ("compile it", "demo/network.txt", f"inspect {SPEC}"),
    ("lay it out", "demo/layout.yaml", f"layout {SPEC} -o demo/layout.yaml"),
    ("run 12,000 steps", "demo/run.npz", f"run {SPEC} --steps 12000 -o demo/run.npz"),
    ("draw step 90", "demo/learning.svg", f"render {SPEC} --recording demo/run.npz --step 90 -o demo/learning.svg"),
    ("draw the last step", "demo/learned.svg", f"render {SPEC} --recording demo/run.npz -o demo/learned.svg"),
    ("the same as PNG", "demo/learned.png", f"render {SPEC} --recording demo/run.npz -o demo/learned.png"),
    ("draw two periods, moving", "demo/moving.svg",
     f"animate {SPEC} --recording demo/run.npz --steps 257 -o demo/moving.svg"),
)  # fmt: skip


def main() -> int:
    """Run the stages; 1 at the first that fails."""
    Path("demo").mkdir(exist_ok=True)
    for what, file, command in STAGES:
        begun = perf_counter()
        done = subprocess.run([sys.executable, "-m", "neurovis_spec", *command.split()], capture_output=True, text=True)
        seconds = perf_counter() - begun
        if done.returncode:
            print(f"neurovis {command}\n{done.stdout}{done.stderr}", file=sys.stderr)
            return 1
        if _prints(command):
            Path(file).write_text(done.stdout, encoding="utf-8")
        print(f"{what:<26}{seconds:5.1f} s   {_size(file) if file else done.stdout.strip()}", flush=True)
    print(_learned())
    print("\nOpen in a browser:")
    print("  demo/moving.svg    the first two periods: the rhythm runs, and what learns glows")
    print("  demo/learning.svg  step 90, in the midst of it; demo/learned.svg, what was learned (also as .png)")
    print("\nThe same by hand, in the checkout (neurovis is .venv/bin/neurovis):")
    for _, file, command in STAGES:
        print(f"  neurovis {command}" + (f" > {file}" if _prints(command) else ""))
    print("\nThe same while it runs, to be turned by hand, in the browser:")
    print("  .venv/bin/pip install '.[live]' && .venv/bin/neurovis live specs/cpg_rbf.yaml --open")
    return 0


def _prints(command: str) -> bool:
    """Whether the file of a stage is what the command prints."""
    return command.startswith("inspect")


def _size(file: str) -> str:
    return f"{file} ({Path(file).stat().st_size / 1024:,.0f} KiB)"


def _learned() -> str:
    """How far the output is from its target, in the first period and in the last."""
    import numpy as np

    import neurovis_spec as nv

    run = nv.load("demo/run.npz")
    error = run["T"] - run["O"]
    first, last = (float(np.sqrt(np.mean(part**2))) for part in (error[:129], error[-129:]))
    return f"the error of O (RMS): {first:.3f} in the first period, {last:.4f} in the last"


if __name__ == "__main__":
    sys.exit(main())
