"""``docs/ros.md``: every command on it runs as it is written, with each ROS, and what it prints is printed."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from ros_page import PAGE, blocks, installing, packages
from ros_worlds import NAMES, ROOT, claimed_domain

import neurovis_spec as nv

TEXT = PAGE.read_text(encoding="utf-8")


@pytest.mark.ros
@pytest.mark.parametrize("name", NAMES)
def test_the_page_leads_to_the_hexapod_and_further(name: str) -> None:
    """In a network of its own, since the ports are those that the page names."""
    here = Path(__file__).parent
    command = [sys.executable, str(here / "isolated.py"), sys.executable, str(here / "ros_page.py"), name]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]
    assert done.stdout.count("\n## ") == len({block.section for block in blocks(TEXT) if ran(block.words, name)})


def ran(words: frozenset[str], name: str) -> bool:
    versions = {"one", "ros1"} if name == "one" else {name, "ros2"}
    asked = words & {"one", "ros1", "kilted", "jazzy", "ros2"}
    return not words & {"install", "packages"} and (not asked or bool(asked & versions))


def test_what_the_page_installs_is_what_is_tested() -> None:
    ci = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    named = {word for line in re.findall(r"packages\+?=\((.*?)\)", ci, re.DOTALL) for word in line.split()}
    assert set(packages()) - named == set()
    assert "tests/ros_page.py $* --install" in (ROOT / "Makefile").read_text(encoding="utf-8")
    for name in NAMES:
        assert f". .ros/{name}/bin/activate" in installing(name).text.splitlines()


def test_the_specs_on_the_page_are_without_findings() -> None:
    specs = re.findall(r"^cat > \w+\.yaml <<'END'\n(.*?)^END$", TEXT, re.MULTILINE | re.DOTALL)
    assert len(specs) == 2
    for spec in specs:
        assert nv.compile_text(spec).warnings == ()


def test_two_worlds_do_not_meet() -> None:
    """Domains are claimed, whichever process asks."""
    claims = [claimed_domain() for _ in range(5)]
    assert len({domain for _, domain in claims}) == 5
    for claim, _ in claims:
        claim.close()
