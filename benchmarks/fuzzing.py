"""How the front end takes texts that no author means: many of them, from a seed, so that every run can be had again.

In: how many specs and expressions, and a seed. Out: what became of them, on standard output; status 1 where a law of
``tests/fuzz_laws.py`` was broken, with the text and what happened in a file each, to be looked at and run again:

    python benchmarks/fuzzing.py --yaml 20000 --expressions 5000 --seed 1
    python benchmarks/fuzzing.py --replay build/fuzzing/FILE

A text that takes longer than ``--patience`` seconds of the processor, or ten times as long on the clock, counts as a
failure: a busy machine is none.
"""

from __future__ import annotations

import argparse
import signal
import sys
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import FrameType

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests"))

import fuzz_expressions
import fuzz_texts
from fuzz_laws import Outcome, check_expression, check_input

ROOT = Path(__file__).resolve().parent.parent
_AT_ONCE = 250


@dataclass(frozen=True, slots=True)
class Failure:
    """A text that broke a law, and how."""

    kind: str
    number: int
    data: bytes
    folder: Path
    why: str


@dataclass(slots=True)
class Tally:
    """What became of several texts."""

    tried: int = 0
    compiled: int = 0
    findings: int = 0
    codes: Counter[str] = field(default_factory=Counter)
    slowest: float = 0.0
    slowest_number: int = -1
    failures: list[Failure] = field(default_factory=list)

    def add(self, other: Tally) -> None:
        self.tried += other.tried
        self.compiled += other.compiled
        self.findings += other.findings
        self.codes += other.codes
        if other.slowest > self.slowest:
            self.slowest, self.slowest_number = other.slowest, other.slowest_number
        self.failures += other.failures


@contextmanager
def patience(seconds: int) -> Iterator[None]:
    """Raise TimeoutError in what takes longer, in seconds of the processor; on the clock ten times as long may pass.
    Only where there are such signals."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise TimeoutError(f"longer than {seconds} s")

    if not hasattr(signal, "SIGPROF"):
        yield
        return
    timers = ((signal.ITIMER_PROF, signal.SIGPROF, seconds), (signal.ITIMER_REAL, signal.SIGALRM, 10 * seconds))
    before = [signal.signal(number, stop) for _, number, _ in timers]
    try:
        for timer, _, longest in timers:
            signal.setitimer(timer, longest)
        yield
    finally:
        for (timer, number, _), handler in zip(timers, before, strict=True):
            signal.setitimer(timer, 0)
            signal.signal(number, handler)


def check(kind: str, data: bytes, folder: Path) -> Outcome:
    """The laws for one input."""
    if kind == "expression":
        return check_expression(data.decode("utf-8", "surrogatepass"))
    return check_input(data, folder)


def make(kind: str, seed: int, number: int) -> tuple[bytes, Path]:
    """The input of this number."""
    if kind == "expression":
        return fuzz_expressions.make(seed, number).encode("utf-8", "surrogatepass"), Path()
    made = fuzz_texts.make(seed, number)
    return made.data, made.folder


def stretch(kind: str, seed: int, longest: int, numbers: range) -> Tally:
    """Some inputs, one after the other."""
    tally = Tally()
    for number in numbers:
        data, folder = make(kind, seed, number)
        begun = time.process_time()
        try:
            with patience(longest):
                outcome = check(kind, data, folder)
        except Exception:
            tally.failures.append(Failure(kind, number, data, folder, traceback.format_exc()))
        else:
            tally.compiled += outcome.compiled
            tally.findings += bool(outcome.codes)
            tally.codes.update(set(outcome.codes))
        took = time.process_time() - begun
        tally.tried += 1
        if took > tally.slowest:
            tally.slowest, tally.slowest_number = took, number
    return tally


def campaign(kind: str, count: int, seed: int, longest: int, jobs: int, first: int = 0) -> Tally:
    """Many inputs, in several processes."""
    whole = Tally()
    parts = [range(start, min(start + _AT_ONCE, first + count)) for start in range(first, first + count, _AT_ONCE)]
    with ProcessPoolExecutor(jobs) as pool:
        for tally in pool.map(partial(stretch, kind, seed, longest), parts):
            whole.add(tally)
    return whole


def shrunk(failure: Failure, longest: int, most: int = 1500) -> bytes:
    """A shorter text that breaks a law in the same way: lines, then stretches of characters left out."""
    last = failure.why.strip().splitlines()[-1][:40]

    def fails(text: str) -> bool:
        try:
            with patience(longest):
                check(failure.kind, text.encode("utf-8", "surrogatepass"), failure.folder)
        except Exception as error:
            return traceback.format_exception_only(error)[-1].strip()[:40] == last
        return False

    try:
        text = failure.data.decode("utf-8", "surrogatepass")
    except UnicodeDecodeError:
        return failure.data
    for pieces in (lambda whole: whole.splitlines(keepends=True), list):
        text, most = _without_needless(text, pieces, fails, most)
    return text.encode("utf-8", "surrogatepass")


def _without_needless(
    text: str, pieces: Callable[[str], list[str]], fails: Callable[[str], bool], most: int
) -> tuple[str, int]:
    parts = pieces(text)
    size = max(1, len(parts) // 2)
    while size and most > 0:
        at = 0
        while at < len(parts) and most > 0:
            fewer = parts[:at] + parts[at + size :]
            most -= 1
            if fails("".join(fewer)):
                parts = fewer
            else:
                at += size
        size //= 2
    return "".join(parts), most


def keep(failure: Failure, folder: Path, seed: int, longest: int) -> Path:
    """Save a failure: the text, shortened; beside it the whole text and what happened."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{failure.kind}-{seed}-{failure.number}.txt"
    path.write_bytes(shrunk(failure, longest))
    path.with_suffix(".whole").write_bytes(failure.data)
    path.with_suffix(".why").write_text(f"{failure.folder}\n{failure.why}", encoding="utf-8", errors="replace")
    return path


def replay(path: Path, longest: int) -> None:
    """Check a saved text again, in the folder that it was made for."""
    why = path.with_suffix(".why")
    folder = Path(why.read_text(encoding="utf-8").splitlines()[0]) if why.exists() else path.parent
    with patience(longest):
        print(check(path.name.split("-")[0], path.read_bytes(), folder))


def main() -> int:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--yaml", type=int, default=20_000, help="how many specs")
    options.add_argument("--expressions", type=int, default=5_000, help="how many expressions")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--first", type=int, default=0, help="the number of the first of each")
    options.add_argument("--jobs", type=int, default=2, help="processes")
    options.add_argument("--patience", type=int, default=20, help="seconds for one text")
    options.add_argument("--keep", type=Path, default=ROOT / "build" / "fuzzing", help="where failures are saved")
    options.add_argument("--codes", action="store_true", help="print how often each code was met")
    options.add_argument("--replay", type=Path, help="check this text instead")
    given = options.parse_args()
    if given.replay:
        replay(given.replay, given.patience)
        return 0
    print(
        f"{'what':12}{'tried':>8}{'compiled':>10}{'findings':>10}{'codes':>7}{'slowest':>10}{'failures':>10}{'time':>9}"
    )
    failures: list[Failure] = []
    for kind, count in (("spec", given.yaml), ("expression", given.expressions)):
        begun = time.perf_counter()
        tally = campaign(kind, count, given.seed, given.patience, given.jobs, given.first)
        print(
            f"{kind + 's':12}{tally.tried:8}{tally.compiled:10}{tally.findings:10}{len(tally.codes):7}"
            f"{tally.slowest:8.2f} s{len(tally.failures):10}{time.perf_counter() - begun:7.0f} s",
            flush=True,
        )
        if given.codes:
            print("  " + ", ".join(f"{code} {number}" for code, number in tally.codes.most_common()))
            print(f"  slowest: {kind} {tally.slowest_number}")
        failures += tally.failures
    for failure in failures[:20]:
        path = keep(failure, given.keep, given.seed, given.patience)
        print(f"{path}: {failure.why.strip().splitlines()[-1][:300]}")
    if len(failures) > 20:
        print(f"… and {len(failures) - 20} more")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
