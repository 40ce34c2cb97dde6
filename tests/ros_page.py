"""Runs the commands of ``docs/ros.md`` as they are written, with one of the three ROS that the page knows.

    python tests/ros_page.py kilted|jazzy|one              all but those that install; FOLDER of ``ros_worlds`` is used
    python tests/ros_page.py kilted|jazzy|one --install    those that install, in the clone

A block of the page that begins with ```sh is for bash; words after it say for which ROS it is (``kilted``, ``jazzy``,
``one``, ``ros2``; all of them where none does), and more: ``install`` makes the environment, ``packages`` needs root,
``stays`` goes on until its section (##) ends, ``remains`` until the page does; it is then ended as by Ctrl-C. Each is a
terminal of its own, in which the environment is activated. A block ```text after it is what is printed (among other
lines); … is anything. A page whose address is printed by what stays is opened, and must show further and further steps.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import aiohttp
from ros_worlds import _OURS, FOLDER, ROOT, Process
from test_live_server import Eyes

PAGE = ROOT / "docs" / "ros.md"
_VERSIONS = {"kilted": "ros2", "jazzy": "ros2", "one": "ros1"}
_STAYING = ("stays", "remains")
_WORDS = {*_VERSIONS, *_VERSIONS.values(), "install", "packages", *_STAYING}
_BLOCK = re.compile(r"^## (?P<title>[^\n]*)$|^```(?P<kind>sh|text)(?P<words>[ \w]*)\n(?P<text>.*?)^```$", re.M | re.S)


@dataclass(frozen=True)
class Block:
    """Commands of a section, for whom they are, and the lines that they print."""

    section: str
    words: frozenset[str]
    text: str
    printed: tuple[str, ...]

    def is_for(self, name: str) -> bool:
        """Whether it is for a ROS."""
        asked = self.words & {*_VERSIONS, *_VERSIONS.values()}
        return not asked or bool(asked & {name, _VERSIONS[name]})


def blocks(text: str) -> list[Block]:
    """The blocks of a page."""
    found: list[Block] = []
    section = ""
    for match in _BLOCK.finditer(text):
        words = frozenset((match["words"] or "").split())
        if match["title"] is not None:
            section = match["title"]
        elif match["kind"] == "sh":
            assert words <= _WORDS, f"{sorted(words - _WORDS)}: nobody knows what that is"
            found.append(Block(section, words, match["text"], ()))
        else:
            last = found[-1]
            found[-1] = Block(last.section, last.words, last.text, (*last.printed, *match["text"].splitlines()))
    return found


def pattern(line: str) -> re.Pattern[str]:
    """What a line that is printed looks like.

    >>> bool(pattern("ready: …, ROS 2").search("ready: x, ROS 2"))
    True
    """
    return re.compile(".*".join(re.escape(part) for part in line.split("…")))


def installing(name: str) -> Block:
    """The block that makes the environment of a ROS."""
    (found,) = (one for one in blocks(PAGE.read_text(encoding="utf-8")) if "install" in one.words and one.is_for(name))
    return found


def packages() -> list[str]:
    """The packages of Debian that the page asks for."""
    (found,) = (one for one in blocks(PAGE.read_text(encoding="utf-8")) if "packages" in one.words)
    return [word for word in found.text.replace("\\\n", " ").split()[2:] if not word.startswith("-")]


def bash(text: str) -> list[str]:
    """The command that runs a block."""
    return ["bash", "-euo", "pipefail", "-c", text]


@dataclass
class Terminals:
    """The terminals of a reader, in a folder like the clone."""

    name: str
    folder: Path
    environment: dict[str, str]

    def run(self, block: Block) -> Process:
        """Run a block, to its end or until it has printed what it prints; raises AssertionError."""
        (activate,) = (line for line in installing(self.name).text.splitlines() if line.startswith(". "))
        print(f"$ {block.text.rstrip()}", flush=True)
        process = Process(bash(f"cd '{self.folder}'\n{activate}\n{block.text}"), self.environment)
        try:
            if block.words & {*_STAYING}:
                assert block.printed, "what stays must say when it is there"
                for line in block.printed:
                    process.wait_for(pattern(line))
            else:
                assert process.end() == 0, (process.out, process.err)
                for line in block.printed:
                    assert any(pattern(line).search(one) for one in [*process.out, *process.err]), (
                        f"'{line}' is not in {process.out} {process.err}"
                    )
        except AssertionError:
            process.kill()
            raise
        print(*process.err[:20], *process.out[:20], sep="\n", flush=True)
        if "stays" in block.words:
            for line in process.err:
                if line.startswith("live: "):
                    print(f"shown: {asyncio.run(shown(line.removeprefix('live: ')))} steps", flush=True)
        return process


async def shown(url: str) -> int:
    """Open a page as a browser does, and look on until it has shown what takes a second or so; how many steps."""
    async with aiohttp.ClientSession() as session:
        async with session.get(url) as answer:
            assert answer.status == 200
        eyes = Eyes(await session.ws_connect(url.replace("/?", "/live?"), max_msg_size=1 << 24))
        await eyes.until(lambda: eyes.step > 0)
        first = eyes.step
        await eyes.until(lambda: eyes.step > first + 30)
        return eyes.step - first


def run(name: str, folder: Path) -> None:
    """Run the page with a ROS; raises AssertionError."""
    kept = {key: value for key, value in os.environ.items() if key not in _OURS and not key.startswith("ROS_")}
    (folder / "specs").symlink_to(ROOT / "specs")
    (folder / ".ros").symlink_to(FOLDER)
    terminals = Terminals(name, folder, {**kept, "PYTHONUNBUFFERED": "1", "ROS_LOG_DIR": str(folder / "log")})
    section = ""
    remaining: list[Process] = []
    staying: list[Process] = []
    try:
        for block in blocks(PAGE.read_text(encoding="utf-8")):
            if not block.is_for(name) or block.words & {"install", "packages"}:
                continue
            if block.section != section:
                close(staying)
                section = block.section
                print(f"\n## {section}", flush=True)
            process = terminals.run(block)
            if "stays" in block.words:
                staying.append(process)
            if "remains" in block.words:
                remaining.append(process)
        close(staying)
        close(remaining)
    finally:
        for process in (*staying, *remaining):
            process.kill()


def close(staying: list[Process]) -> None:
    """End what has stayed, as by Ctrl-C, the last first; raises AssertionError."""
    while staying:
        process = staying[-1]
        assert process.running, (process.out, process.err)
        process.interrupt()
        assert process.end() == 0, (process.out, process.err)
        print(*process.out[-12:], sep="\n", flush=True)
        staying.pop()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", choices=tuple(_VERSIONS))
    parser.add_argument("--install", action="store_true")
    asked = parser.parse_args()
    if asked.install:
        sys.exit(subprocess.run(bash(installing(asked.name).text), cwd=ROOT, check=False).returncode)
    folder = Path(tempfile.mkdtemp(prefix="neurovis-ros-page-"))
    try:
        run(asked.name, folder)
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
