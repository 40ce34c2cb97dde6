"""What all tests share: ``--update-golden`` writes the golden files anew, to be read in the diff before they are
committed."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

from neurovis_spec import user_cache
from neurovis_spec.interrupts import ENDING
from neurovis_spec.runtime import c_backend
from neurovis_spec.runtime.backend import ENVIRONMENT_VARIABLE

if TYPE_CHECKING:
    from ros_worlds import World

# A shell that starts the tests in the background, or nohup, has them ignore signals that end a process, and so all that
# they start; some test these.
for _number in ENDING:
    if signal.getsignal(_number) is signal.SIG_IGN:
        signal.signal(_number, signal.default_int_handler if _number == signal.SIGINT else signal.SIG_DFL)

# Array code needs no compiler, and compiles nothing anew for each example: of this process and of those that it starts.
os.environ[ENVIRONMENT_VARIABLE] = "numpy"

# What is kept for this user is neither read nor written: a test sees what is computed now.
os.environ[user_cache.ENVIRONMENT_VARIABLE] = "off"

# How long an example takes says something of the machine, not of the program. The examples are the same in each run, so
# that a change is judged by what it changes; --hypothesis-profile=explore looks for new ones.
settings.register_profile("explore", deadline=None)
settings.register_profile("untimed", deadline=None, derandomize=True)
settings.load_profile("untimed")


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--update-golden", action="store_true", help="write tests/golden anew instead of comparing")


#: Files in which a test takes long, or one fixture most of the time: they come first, so that none of them is what the
#: other workers wait for in the end, or is shared out among them.
LONG = ("test_tour.py", "test_wheel.py")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: item.path.name not in LONG)


@pytest.fixture
def update_golden(request: pytest.FixtureRequest) -> bool:
    return bool(request.config.getoption("--update-golden"))


@pytest.fixture
def signal_handlers() -> Iterator[None]:
    """Afterwards signals that end a process have the handlers that they had before."""
    before = {number: signal.getsignal(number) for number in ENDING}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture(params=[0, 600], ids=["loops", "written out"])
def small(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Both ways to write a network in C."""
    monkeypatch.setattr(c_backend, "SMALL", request.param)
    c_backend.forget()
    yield
    c_backend.forget()


@pytest.fixture(params=("kilted", "jazzy", "one"))
def ros(request: pytest.FixtureRequest) -> Iterator[World]:
    """Each ROS that there is for the tests; ``ros_worlds`` is for Linux alone."""
    from ros_worlds import world

    with world(request.param) as made:
        yield made


@pytest.fixture
def one() -> Iterator[World]:
    """ROS 1."""
    from ros_worlds import world

    with world("one") as made:
        yield made
