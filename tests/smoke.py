"""Every command once, as a process, with the dependencies that are there: none ends in a traceback.

In: an environment in which NeuroVis is installed with its extras. Out: whether all of it can be called there; what it
gives is the other tests' concern. These are no part of ``make test``, whose environment has the newest dependencies;
``make test-lowest`` and ``make test-pythons`` run them with the oldest, and with other Pythons.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tomllib
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest

from neurovis_spec.cli.commands import COMMANDS
from neurovis_spec.cli.ros import RosCommands

ROOT = Path(__file__).parents[1]
SECONDS = 120  # nothing here takes long: who waits for more has hung
PLACED = """\
neurovis: 1
name: placed
neurons: {A: {count: 6, bias: 1, position: [i, i*i]}}
connections: {A -> A: {pattern: ring}}
"""
NO_ROS = "there is no ROS here"


def each(line: str, words: str) -> list[str]:
    """The line with each of the words in the place of #."""
    return [line.replace("#", word) for word in words.split()]


#: What is called, in this order, in a folder that holds net.yaml, net.npz, placed.yaml and walk/walk.yaml. What stands
#: behind -o is there afterwards.
CALLS: Sequence[str] = (
    "new first",
    "new legs --from hexapod",
    "new --from list",
    "validate net.yaml first.yaml legs/legs.yaml",
    *each("validate net.yaml --format #", "json sarif github"),
    "explain unknown-value",
    *each("inspect net.yaml --format #", "text json"),
    *each("docs #", "gaussian hebbian all_to_all"),
    "fmt --check net.yaml",
    "schema",
    "layout net.yaml -o net.layout.yaml",
    "layout net.yaml --update net.layout.yaml",
    "layout net.yaml --metrics",
    *each("layout net.yaml --engine #", "layered organic circular grid large"),
    "layout placed.yaml --engine spatial",
    "layout legs/legs.yaml --effort quick -o legs.layout.yaml",
    *each("run net.yaml --steps 50 -o x.#", "npz csv mcap"),
    *each("run net.yaml --steps 50 --backend #", "reference numpy c"),
    "run net.yaml --steps 50 --checkpoint net.checkpoint",
    "run walk/walk.yaml --steps 20 -o walk.npz",
    "run --backend list",
    "sweep net.yaml --over seed=0..1 --metric rms(O) --steps 50",
    *each("sweep net.yaml --over seed=0..1 --metric rms(O) --steps 50 -o table.#", "csv parquet"),
    "analyze net.yaml --recording net.npz --no-trials -o readings",
    *each("render net.yaml --recording net.npz -o still.#", "svg pdf png gif webp"),
    "render net.yaml --recording net.npz --view network --view traces --view raster --view weights -o views.png",
    "render net.yaml --view matrix --theme dark -o matrix.svg",
    "render walk/walk.yaml --recording walk.npz -o walk.png",
    *each("animate net.yaml --recording net.npz --frames 4 -o film.#", "svg gif webp mp4 webm"),
    "export net.yaml --to c -o controller",
    *each("ros export net.yaml --to # -o ros-#", "package cpp publisher"),
)
#: What meets a ROS, which no package of Python alone brings: this is said.
WITHOUT_ROS = ("ros run net.yaml", "ros view", "ros legacy", "ros play x.mcap")
#: What each extra is for, where no command shows it.
EXTRAS = {
    "pandas": "assert len(nv.load('net.npz').to_pandas()) == 60",
    "xarray": "assert nv.load('net.npz').to_xarray().sizes['step'] == 60",
    "jupyter": "import neurovis_spec.notebook.widget",
    "parquet": "nv.sweep('net.yaml', {'seed': '0..1'}, 'rms(O)', steps=20).save('y.parquet')",
    "bags": "nv.compile('net.yaml').run(20).save('y.mcap'); assert len(nv.load('y.mcap')) == 20",
    "cluster": "from distributed import Client, LocalCluster\n"
    "if __name__ == '__main__':\n"
    "  with LocalCluster(n_workers=1, dashboard_address=None) as cluster:\n"
    "    table = nv.sweep('net.yaml', {'seed': '0..1'}, 'rms(O)', steps=20, scheduler=cluster.scheduler_address)\n"
    "    assert not any(table['error'])",
}
#: Extras that calls above need.
SHOWN = {"analyze", "c", "live", "lsp", "ros", "sim", "video"}


def process(*arguments: str, folder: Path, status: int = 0) -> str:
    """What Python prints when it is called so. It must end with this status, and without a traceback."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=SECONDS,
        stdin=subprocess.DEVNULL,
    )
    assert "Traceback" not in done.stderr, done.stderr
    assert done.returncode == status, done.stderr
    return done.stdout + done.stderr


def call(line: str, folder: Path, status: int = 0) -> str:
    return process("-m", "neurovis_spec", *line.split(), folder=folder, status=status)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("smoke")
    (made / "placed.yaml").write_text(PLACED, encoding="utf-8")
    for line in ("new net --from cpg_rbf", "new walk --from walk", "run net.yaml --steps 60 -o net.npz"):
        call(line, made)
    return made


@pytest.mark.parametrize("line", CALLS)
def test_a_call_comes_to_its_end(folder: Path, line: str) -> None:
    call(line, folder)
    _, _, output = line.partition(" -o ")
    assert (folder / output).exists()


@pytest.mark.parametrize("line", WITHOUT_ROS)
def test_without_ros_that_is_said(folder: Path, line: str) -> None:
    assert NO_ROS in call(line, folder, status=1)


@pytest.mark.parametrize("extra", EXTRAS)
def test_an_extra_is_of_use_in_python(folder: Path, extra: str) -> None:
    (folder / f"{extra}_used.py").write_text(f"import neurovis_spec as nv\n{EXTRAS[extra]}\n", encoding="utf-8")
    process(f"{extra}_used.py", folder=folder)


@contextmanager
def started(line: str, folder: Path) -> Iterator[subprocess.Popen[str]]:
    """A command that runs until it is ended."""
    command = [sys.executable, "-m", "neurovis_spec", *line.split()]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    with subprocess.Popen(command, cwd=folder, text=True, **pipes) as made:  # type: ignore[call-overload]
        try:
            yield made
        finally:
            made.kill()


def test_the_live_view_opens_and_ends(folder: Path) -> None:
    with started("live net.yaml", folder) as live:
        assert live.stdout is not None
        url = live.stdout.readline().strip()
        with urllib.request.urlopen(url, timeout=SECONDS) as page:
            assert b"<canvas" in page.read()
        live.send_signal(signal.SIGINT)
        _, told = live.communicate(timeout=SECONDS)
    assert "Traceback" not in told
    assert live.returncode == 128 + signal.SIGINT


def test_the_language_server_answers_and_ends(folder: Path) -> None:
    asked = (
        {"id": 1, "method": "initialize", "params": {"processId": os.getpid(), "rootUri": None, "capabilities": {}}},
        {"method": "initialized", "params": {}},
        {"id": 2, "method": "shutdown"},
        {"method": "exit"},
    )
    bodies = [json.dumps({"jsonrpc": "2.0", **message}) for message in asked]
    with started("lsp --stdio", folder) as server:
        answers, told = server.communicate(
            "".join(f"Content-Length: {len(body)}\r\n\r\n{body}" for body in bodies), SECONDS
        )
    assert '"name":"neurovis"' in answers.replace(" ", "")
    assert "Traceback" not in told
    assert server.returncode == 0


def test_no_command_and_no_extra_is_left_out() -> None:
    lines = [*CALLS, *WITHOUT_ROS, "live", "lsp"]
    assert {line.split()[0] for line in lines} == set(COMMANDS)
    assert {line.split()[1] for line in lines if line.startswith("ros ")} == set(RosCommands.TABLE)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert {*EXTRAS, *SHOWN, "test"} == set(project["optional-dependencies"])
