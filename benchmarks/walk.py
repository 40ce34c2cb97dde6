"""Use case 2: how many of ten seeds learn to walk, and how far they come, by each of two rules; beside one leg.

    .venv/bin/python benchmarks/walk.py [--seeds 10] [--jobs 2]

For each seed the spec is run as it is (250 episodes), its rule K -> O replaced by name where another one is told of. A
number is the way in an episode, the mean of the ten episodes up to that one, with mean and standard deviation over the
seeds. A seed has learned where the last 25 episodes bring it further than 0.3 m (of the leg: 2) on average.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import numpy.typing as npt

import neurovis_spec as nv

SPECS = Path(__file__).parent.parent / "specs"
#: episodes up to which ten are averaged, of the body and of the leg
EPISODES = {"walk/walk.yaml": (10, 50, 100, 250), "reward.yaml": (10, 50, 100, 316)}
LEARNED = {"walk/walk.yaml": 0.3, "reward.yaml": 2.0}
EPISODE = 63  # steps


@dataclass(frozen=True)
class Contender:
    """A spec, the rule that takes the place of its own, parameters."""

    name: str
    spec: str
    rule: str = "policy_gradient"
    parameters: dict[str, float] = field(default_factory=dict)


CONTENDERS = (
    Contender("walk, policy gradient", "walk/walk.yaml"),
    Contender("walk, Eq. 15 as printed, O around 1", "walk/walk.yaml", "as_printed", {"centre": 1}),
    Contender("walk, Eq. 15 as printed, O around 0", "walk/walk.yaml", "as_printed"),
    Contender("one leg, Eq. 15 as printed, O around 1", "reward.yaml"),
)


def ways(contender: Contender, seed: int) -> npt.NDArray[np.float64]:
    """The way that was made in each episode of a run."""
    path = SPECS / contender.spec
    text = path.read_text(encoding="utf-8").replace("{policy_gradient: {", f"{{{contender.rule}: {{")
    network = nv.compile_text(text, folder=path.parent, seed=seed, parameters=contender.parameters)
    run = network.run()
    if run.sensors is None:
        return run["D"][EPISODE - 1 :: EPISODE]
    return run.sensors[EPISODE - 1 :: EPISODE, list(run.sensor_names).index("torso_x")]


def row(contender: Contender, found: npt.NDArray[np.float64]) -> str:
    """A line of the table; ``found`` is seeds × episodes."""
    cells = [contender.name]
    for episode in EPISODES[contender.spec]:
        each = found[:, episode - 10 : episode].mean(axis=1)
        cells.append(f"{each.mean():.2f} ± {each.std(ddof=1):.2f}")
    last = found[:, -25:].mean(axis=1)
    learned = int((last > LEARNED[contender.spec]).sum())
    cells += [f"{last.min():.2f} to {last.max():.2f}", f"{learned} of {len(found)}"]
    return "| " + " | ".join(cells) + " |"


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table, a line for each contender."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args(arguments)
    print("| what learns | after episode 10 | 50 | 100 | 250 (leg: 316) | last 25, worst to best | learned |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    seeds = range(1, options.seeds + 1)
    with ProcessPoolExecutor(options.jobs, get_context("spawn")) as pool:
        for contender in CONTENDERS:
            print(row(contender, np.array(list(pool.map(partial(ways, contender), seeds)))), flush=True)


if __name__ == "__main__":
    main()
