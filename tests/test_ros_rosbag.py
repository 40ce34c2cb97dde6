"""What ROS 1's own ``rosbag`` makes of a bag of ours: it appends, indexes, compresses and mends it as its own."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from test_ros_recorder import START, TOPIC, arrays_in, made, sent

from neurovis_spec.ros.bags import read_bag
from neurovis_spec.ros.files import Rotation

pytestmark = pytest.mark.ros

#: of ROS 1 as Debian has it
PYTHON = "/usr/bin/python3"
#: the messages of a bag's topic, as hex, and how many connections and chunks it has
READ = """
import rosbag, sys
with rosbag.Bag(sys.argv[1]) as bag:
    for _, message, _ in bag.read_messages([sys.argv[2]], raw=True):
        print(message[1].hex())
"""
APPEND = """
import genpy, rosbag, sys
from std_msgs.msg import Float64MultiArray, String
with rosbag.Bag(sys.argv[1], "a") as bag:
    for number in range(300):
        time = genpy.Time(1_700_000_100 + number)
        bag.write(sys.argv[2], Float64MultiArray(data=[number]), time)
        bag.write("/note", String("of somebody else"), time)
"""
#: a bag of rosbag's own, with the messages of another one
AGAIN = """
import rosbag, sys
with rosbag.Bag(sys.argv[1]) as bag, rosbag.Bag(sys.argv[2], "w") as again:
    for topic, message, time, header in bag.read_messages(raw=True, return_connection_header=True):
        again.write(topic, message, time, raw=True, connection_header=header)
"""
#: what begins a bag: as many bytes in every one that rosbag writes
BEGINNING = len(b"#ROSBAG V2.0\n") + 4 + 4 + 4096


def done(*command: str | Path) -> str:
    """What a program prints, which goes well."""
    clean = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    ended = subprocess.run([str(word) for word in command], capture_output=True, text=True, env=clean, timeout=60)
    assert ended.returncode == 0, ended.stderr
    assert "ERROR" not in ended.stderr, ended.stderr
    return ended.stdout


def theirs(path: Path, topic: str = TOPIC) -> list[bytes]:
    """The messages of a topic, as rosbag reads them."""
    return [bytes.fromhex(line) for line in done(PYTHON, "-c", READ, path, topic).split()]


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("ours") / "x.bag"
    made(path, 1, 2000)
    return path


@pytest.fixture
def bag(ours: Path, tmp_path: Path) -> Path:
    """A bag of ours of 2,000 messages, to be worked upon."""
    return Path(shutil.copy(ours, tmp_path))


def test_a_bag_begins_as_those_of_rosbag_do_to_the_byte(bag: Path) -> None:
    again = bag.with_name("again.bag")
    done(PYTHON, "-c", AGAIN, bag, again)
    first, second = bag.read_bytes()[:BEGINNING], again.read_bytes()[:BEGINNING]
    numbers = slice(13 + 4 + 4 + len(b"op=\3"), None)  # where the index is, and of how many connections and chunks
    assert first[:21] == second[:21]
    names = [b"index_pos=", b"conn_count=", b"chunk_count="]
    for name, size in zip(names, (8, 4, 4), strict=True):
        for one in (first, second):
            assert one[numbers].count(name) == 1
        at, other = first.index(name) + len(name), second.index(name) + len(name)
        assert at == other
        first = first[:at] + bytes(size) + first[at + size :]
        second = second[:other] + bytes(size) + second[other + size :]
    assert first == second


def test_rosbag_appends_to_it(bag: Path) -> None:
    before = read_bag(bag).about
    done(PYTHON, "-c", APPEND, bag, TOPIC)
    found = theirs(bag)
    assert found[:2000] == sent(1, range(2000))
    assert len(found) == 2300
    assert arrays_in(bag) == found
    assert len([one for one in read_bag(bag).messages() if one.topic.name == "/note"]) == 300
    assert read_bag(bag).about == before


def test_files_that_go_on_are_found_where_rosbag_has_written_the_first_anew(tmp_path: Path) -> None:
    messages = made(tmp_path / "x.bag", 1, 3000, Rotation(size=150_000))
    assert (tmp_path / "x-1.bag").exists()
    done("rosbag", "compress", "-q", tmp_path / "x.bag")
    assert arrays_in(tmp_path / "x.bag") == messages


@pytest.mark.parametrize("how", ["--bz2", "--lz4"])
def test_rosbag_compresses_it(how: str, bag: Path) -> None:
    size = bag.stat().st_size
    done("rosbag", "compress", "-q", how, bag)
    assert bag.stat().st_size < size / 2
    assert theirs(bag) == arrays_in(bag) == sent(1, range(2000))


def test_rosbag_mends_it(bag: Path) -> None:
    fixed = bag.with_name("fixed.bag")
    assert "successfully" in done("rosbag", "fix", bag, fixed)
    assert theirs(fixed) == arrays_in(fixed) == sent(1, range(2000))


def test_rosbag_indexes_one_that_kill_9_has_cut_off(tmp_path: Path) -> None:
    code = f"""
import sys, time
sys.path.insert(0, {str(Path(__file__).parent)!r})
from pathlib import Path
from test_ros_recorder import *
recorder = Recorder(files(Path(sys.argv[1]), 1), {{ARRAY: text_of_type(ARRAY, 1)}}, print)
recorder.start()
one = stream(1)
for step in range(10**9):
    recorder.put(one, Arrival(sent(1, range(step, step + 1))[0], {START} + step * 1_000_000, None, ARRAY))
    time.sleep(0.0005)
    if one.counts.recorded > 500:
        print("enough", flush=True)
"""
    path = tmp_path / "x.bag"
    child = subprocess.Popen([sys.executable, "-c", code, str(path)], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    assert child.stdout.readline() == "enough\n"
    os.kill(child.pid, signal.SIGKILL)
    child.wait(20)
    child.stdout.close()
    with pytest.warns(UserWarning, match="breaks off"):
        messages = arrays_in(path)
    done("rosbag", "reindex", "-q", path)
    assert theirs(path) == messages == sent(1, range(len(messages)))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert arrays_in(path) == messages
    assert len(messages) > 500
