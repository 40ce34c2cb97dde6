"""The page as it is shipped: put together from its modules, small, and described in docs/live.md message by message."""

from __future__ import annotations

import gzip
import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest

from neurovis_spec.live.clock import SPEEDS
from neurovis_spec.live.protocol import LARGEST, MESSAGES
from neurovis_spec.live.server import ASKING, BURST, MOST_CLIENTS, MOST_CONNECTIONS, PINGS, RATE
from neurovis_spec.live.shipped import page

ROOT = Path(__file__).parents[1]
MODULES = ROOT / "neurovis_spec/live/page"


@pytest.fixture(scope="module")
def build() -> ModuleType:
    found = importlib.util.spec_from_file_location("build", MODULES / "build.py")
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


def test_the_shipped_page_was_made_of_its_modules_as_they_are(build: ModuleType) -> None:
    """``make page-check`` makes it anew and compares."""
    assert f"made of {build.digest()} by" in page(), "run make page"


def test_it_is_small_and_asks_nobody_else() -> None:
    assert len(gzip.compress(page().encode(), 9)) <= 100 * 1024
    assert not re.findall(r"(?:https?:)?//[a-z]", page())
    assert "eval(" not in page()
    assert "innerHTML" not in page()


def test_every_message_and_limit_is_documented() -> None:
    text = (ROOT / "docs/live.md").read_text(encoding="utf-8")
    sent = {
        "status",
        "values",
        "findings",
        "refused",
        "moved",
        "placed",
        "saving",
        "making",
        "fitting",
        "body",
        "measured",
        "undefined",
        "views",
    }
    assert set(re.findall(r'\{"type": "(\w+)"', text)) == {*MESSAGES, *sent}
    for speed in SPEEDS:
        assert speed in text
    for limit in (
        f"{LARGEST // 1024} KiB",
        f"{MOST_CLIENTS} websockets",
        f"beyond {MOST_CONNECTIONS}",
        f"{RATE} messages",
    ):
        assert limit in text
    for limit in (f"{BURST} at once", f"after {ASKING:g} s", f"after {PINGS:g} s"):
        assert limit in text


def test_every_intrusion_that_is_documented_is_tried() -> None:
    """A row of the table for each kind of test, so that neither is forgotten."""
    table = (ROOT / "docs/live.md").read_text(encoding="utf-8").partition("## Intrusions")[2]
    tests = (ROOT / "tests/test_live_server.py").read_text(encoding="utf-8")
    for words, test in {
        "without the token": "without_the_token", "a Host": "foreign_host", "an Origin": "foreign_origin",
        "other paths": "other_paths_and_methods", "Content-Security-Policy": "strict_policy",
        "no JSON": "broken_message",
        "above 16 KiB": "huge_message", "messages a second": "flood", "compressed": "compressed_bombs",
        "a viewer that asks": "a_viewer_looks_on", "websockets": "more_than_there_may_be", "a thousand": "a_thousand",
        "first request": "asks_for_nothing", "reads nothing": "never_reads",
    }.items():  # fmt: skip
        assert words in table
        assert re.search(rf"def test_\w*{test}", tests), test
