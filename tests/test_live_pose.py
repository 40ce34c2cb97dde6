"""What the live view sends of a body: how it is drawn, once, and its pose with each frame; and the past of both."""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from bodies_by_hand import hexapod, posed
from toy_bodies import SKELETON, SPEC, Cart, carted, registered

import neurovis_spec as nv
from neurovis_spec.body import Link, Port, Skeleton, skeleton_of
from neurovis_spec.live.declared import declared
from neurovis_spec.live.hub import Client, Hub
from neurovis_spec.live.protocol import FRAME, SCENE, body_message
from neurovis_spec.live.recorded import RecordedSource
from neurovis_spec.live.run import Run, Shown
from neurovis_spec.live.saving import film, picture, told_by
from neurovis_spec.live.simulated import SimulatedSource
from neurovis_spec.live.source import NOTHING, Drawn, Source
from neurovis_spec.live.view import View, view_of


@pytest.fixture(autouse=True)
def _carts(monkeypatch: pytest.MonkeyPatch) -> None:
    registered(monkeypatch)


NS = "{http://www.w3.org/2000/svg}"
PLAIN = nv.compile_text("neurovis: 1\nname: plain\ntime: {dt: 0.05, steps: 30}\nneurons: {A: {}, B: {}}\n")


def shown(source: Source, view: View) -> Shown:
    return Run(source, view, lambda _: None).shown()


def sent(*several: Shown) -> list[bytes | str]:
    """What a client is sent that sees each of these."""

    async def look() -> list[bytes | str]:
        hub, client = Hub(asyncio.get_running_loop()), Client(True)
        hub.join(client)
        messages: list[bytes | str] = []
        for one in several:
            hub.show(one)
            await asyncio.sleep(0)
            messages += hub.messages(client)
            client.ahead.clear()
        return messages

    return asyncio.run(look())


def poses(messages: list[bytes | str]) -> Iterator[list[float]]:
    """The poses of the frames among messages, with what the motors are told behind them."""
    for message in messages:
        if isinstance(message, bytes) and message[0] == FRAME:
            count = struct.unpack_from("<H", message, 38)[0]
            yield np.frombuffer(message[len(message) - 4 * count :], "<f4").tolist()


def bodies(messages: list[bytes | str]) -> list[dict[str, object]]:
    """The messages that say how a body is drawn."""
    read = [json.loads(message) for message in messages if isinstance(message, str)]
    return [message for message in read if message["type"] == "body"]


def test_a_body_that_runs_is_drawn_as_it_was_recorded_also_of_the_past() -> None:
    network = carted()
    source, view = SimulatedSource(network.simulator()), view_of(network, network.gains)
    recording = network.run(100)
    assert recording.pose is not None
    seen = [shown(source, view)]
    for step in [*range(1, 100), 17, 64, 3]:
        source.go(step) if step <= source.reach.last else source.advance()
        seen.append(shown(source, view))
    for one in seen:
        assert one.glance.pose.tolist() == recording.pose[one.glance.step].astype(np.float32).tolist()
    assert [one.glance.step for one in seen[-3:]] == [17, 64, 3]
    messages = sent(*seen[:3], seen[-1])
    assert list(poses(messages)) == [
        seen[at].glance.pose.tolist() + seen[at].glance.told.tolist() for at in (0, 1, 2, -1)
    ]


def test_what_moves_a_body_is_told_with_its_pose_also_of_the_past() -> None:
    """By the formulas of the spec, from what was recorded: 0.8 O1 pushes, O2 − 2 O1 + π dt lifts the second joint."""
    network = carted()
    source, view = SimulatedSource(network.simulator()), view_of(network, network.gains)
    recording = network.run(60)
    drive, other = recording["O1"], recording["O2"]
    wanted = np.stack([0.8 * drive, 0 * drive, other - 2 * drive + np.pi * 0.05], axis=1)
    for step in [*range(60), 17, 41, 0]:
        while source.reach.last < step:
            source.advance()
        source.go(step)
        if step != 39:  # where the first episode ends
            assert shown(source, view).glance.told == pytest.approx(wanted[step], rel=1e-6)


def test_it_is_said_once_which_joints_the_motors_move_and_how_far_they_go(monkeypatch: pytest.MonkeyPatch) -> None:
    network = carted()
    told: list[list[object]] = [["push", -1.0, 1.0], ["lift[0]", None, None], ["lift[1]", None, None]]
    for joints, wanted in (((), (-1, -1, -1)), ((0, -1, 1), (0, -1, 1))):
        monkeypatch.setattr(Cart, "skeleton", replace(SKELETON, joints=joints))
        messages = sent(shown(SimulatedSource(network.simulator()), view_of(network, network.gains)))
        assert [one["motors"] for one in bodies(messages)] == [
            [[point, *rest] for point, rest in zip(wanted, told, strict=True)]
        ]


def test_each_number_of_a_motor_has_the_range_that_is_known_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    lift = Port.ranged("lift", "", [(-0.4, 0.5), (-2.0, float("inf"))])
    assert (lift.size, lift.low, lift.high) == (2, -2.0, float("inf"))
    monkeypatch.setattr(Cart, "actuators", (Cart.actuators[0], lift))
    network = carted()
    (told,) = bodies(sent(shown(SimulatedSource(network.simulator()), view_of(network, network.gains))))
    assert told["motors"] == [[-1, "push", -1.0, 1.0], [-1, "lift[0]", -0.4, 0.5], [-1, "lift[1]", -2.0, None]]


def test_a_body_of_other_motors_is_told_of_also_where_it_is_drawn_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a plug-in that has one skeleton for all its bodies; one that is as before is not told of again."""
    network = carted()
    view, seen = view_of(network, network.gains), []
    for high in (1.0, 1.0, 3.0):
        monkeypatch.setattr(Cart, "actuators", (Port("push", 1, low=-1.0, high=high), Cart.actuators[1]))
        seen.append(shown(SimulatedSource(network.simulator()), view))
    assert all(one.body.skeleton is SKELETON for one in seen)
    assert [one["motors"][0] for one in bodies(sent(*seen))] == [  # type: ignore[index]
        [-1, "push", -1.0, 1.0],
        [-1, "push", -1.0, 3.0],
    ]


def test_where_an_episode_ends_the_body_is_told_nothing_also_of_the_past() -> None:
    """Unless it goes on in the next one as it was."""
    for resets, told in ((True, 0), (False, 3)):
        network = carted(each_episode=resets)
        source, view = SimulatedSource(network.simulator()), view_of(network, network.gains)
        found = []
        for step in (*range(42), 39, 40, 38, 39):
            source.go(step) if step <= source.reach.last else source.advance()
            found.append(len(shown(source, view).glance.told))
        assert found == [*(3,) * 39, told, 3, 3, told, 3, 3, told]


def test_of_commands_that_are_no_numbers_nothing_is_told() -> None:
    """An episode that ends behind them takes none."""
    spec = SPEC.replace("weight: 0.6", "weight: 1e308").replace("2, activation: tanh}\nconn", "2}\nconn")
    network = carted(spec=spec.replace("episode: 40", "episode: 23"))
    source, view = SimulatedSource(network.simulator()), view_of(network, carted().gains)
    told = [len(shown(source, view).glance.told)]
    for _ in range(22):
        assert source.advance()
        told.append(len(shown(source, view).glance.told))
    assert told == [3] * 22 + [0]
    assert len(shown(source, view).glance.pose) == SKELETON.size


def test_how_it_is_drawn_is_sent_once_before_its_first_pose() -> None:
    network = carted()
    source, view = SimulatedSource(network.simulator()), view_of(network, network.gains)
    first = shown(source, view)
    source.advance()
    messages = sent(first, shown(source, view))
    (told,) = bodies(messages)
    kinds = [message[0] if isinstance(message, bytes) else json.loads(message)["type"] for message in messages]
    assert kinds == [SCENE, "status", "body", FRAME, FRAME]
    assert skeleton_of(json.dumps(told["skeleton"])) == SKELETON
    assert told["motors"] == [[-1, "push", -1.0, 1.0], [-1, "lift[0]", None, None], [-1, "lift[1]", None, None]]
    assert told["start"] == pytest.approx(network.run(1).pose[0, :2].tolist())  # type: ignore[index]


def test_another_body_is_told_of_when_the_network_is_edited_and_none_where_it_has_none() -> None:
    view, run = view_of(PLAIN, PLAIN.gains), PLAIN.run()
    skeleton, walked = hexapod(len(run))
    source = RecordedSource(PLAIN.network, posed(run, skeleton, walked))
    point = Skeleton(("point",), ())
    other = RecordedSource(PLAIN.network, posed(run, point, np.ones((len(run), 3))))
    messages = sent(shown(source, view), shown(other, view), shown(RecordedSource(PLAIN.network, run), view))
    told = bodies(messages)
    read = [one["skeleton"] and skeleton_of(json.dumps(one["skeleton"])) for one in told]
    assert read == [skeleton, point, None]
    assert [len(pose) for pose in poses(messages)] == [skeleton.size, 3, 0]
    assert [one["motors"] for one in told] == [[], [], []]
    assert [one["start"] for one in told] == [[0.0, 0.0], [1.0, 1.0], [0.0, 0.0]]


@pytest.mark.parametrize("given", ["bare", None])
def test_of_what_has_nothing_to_draw_nothing_is_said(given: str | None) -> None:
    network = PLAIN if given is None else carted(given)
    source = SimulatedSource(network.simulator())
    messages = sent(shown(source, view_of(network, network.gains)))
    assert bodies(messages) == []
    assert list(poses(messages)) == [[]]


def test_inputs_say_which_sensors_they_are_and_in_which_units() -> None:
    assert declared(carted())["inputs"] == [{"name": "arms", "size": 2, "description": "senses arm (rad)"}]
    assert declared(PLAIN)["inputs"] == []


def test_a_recording_is_drawn_by_the_poses_of_its_rows() -> None:
    run = PLAIN.run()
    skeleton, walked = hexapod(len(run))
    walked[9] = np.nan
    walked[10, 0] = 1e300
    source = RecordedSource(PLAIN.network, posed(run, skeleton, walked))
    view = view_of(PLAIN, PLAIN.gains)
    for step in (0, 9, 10, 22):
        source.go(step)
        with np.errstate(over="ignore"):
            wanted = walked[step].astype(np.float32)
        assert shown(source, view).glance.pose.tobytes() == wanted.tobytes()


def test_a_body_of_more_numbers_than_a_frame_holds_is_not_drawn() -> None:
    run = PLAIN.run(2)
    vast = Skeleton(tuple(f"p{number}" for number in range(22_000)), (Link(0, 1, 0.1),))
    source = RecordedSource(PLAIN.network, posed(run, vast, np.zeros((2, vast.size))))
    messages = sent(shown(source, view_of(PLAIN, PLAIN.gains)))
    assert [one["skeleton"] for one in bodies(messages)] == [None]
    assert list(poses(messages)) == [[]]
    assert json.loads(body_message(replace(Drawn(vast))))["skeleton"] is None


def test_a_picture_and_a_film_that_are_saved_have_the_body_below_the_network(tmp_path: Path) -> None:
    network = carted()
    source, view = SimulatedSource(network.simulator()), view_of(network, network.gains)
    for _ in range(20):
        source.advance()
    told = told_by(source, 10)
    plain = ET.fromstring(picture(view, replace(told, body=NOTHING)))
    network.render(tmp_path / "x.svg", step=19, view=["network", "body"])
    rendered = ET.parse(tmp_path / "x.svg").getroot()
    for made in (picture(view, told), film(view, told)):
        root = ET.fromstring(made)
        assert [group for group in root.iter(f"{NS}g") if group.attrib.get("data-view") == "body"]
        assert float(root.attrib["height"]) > float(plain.attrib["height"]) + 200
        assert root.attrib["width"] == rendered.attrib["width"]
        assert len([one for one in root.iter() if "data-neuron" in one.attrib]) == len(network.network.neurons)
