"""Models of MuJoCo as bodies: sensors, actuators, pose, state; what is broken is reported, never a crash."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from neurovis_bodies import mujoco as kind

from neurovis_spec.body import Body, BodyError, BodyMissingError, load_kind, open_body

LEG = """\
<mujoco>
  <option timestep="0.01"/>
  <worldbody>
    <geom type="plane" size="1 1 0.1"/>
    <geom name="wall" type="box" pos="1 0 0.5" euler="0 0 90" size="0.1 1 0.5"/>
    <body name="base" pos="0 0 0.5">
      <freejoint/>
      <geom type="box" size="0.2 0.1 0.05"/>
      <body name="leg" pos="0.2 0.3 0">
        <joint name="hip" axis="0 1 0" damping="0.1"/>
        <geom type="capsule" fromto="0 0 0 0.1 0 -0.4" size="0.03"/>
        <site name="tip" pos="0.1 0 -0.4" size="0.04"/>
      </body>
      <body name="prop" pos="-0.2 -0.02 -0.02">
        <geom name="left_foot" type="capsule" fromto="0 0 0 0 0 -0.45" size="0.02"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position name="hip" joint="hip" kp="20" ctrlrange="-1 1"/>
    <motor joint="hip"/>
    <motor name="push" joint="hip"/>
  </actuator>
  <sensor>
    <framepos name="place" objtype="body" objname="base"/>
    <gyro site="tip"/>
    <touch name="touch" site="tip"/>
    <jointpos name="angle" joint="hip"/>
  </sensor>
</mujoco>
"""


def opened(folder: Path, text: str = LEG, dt: float = 0.05, substeps: int | None = None) -> Body:
    path = folder / "leg.xml"
    path.write_text(text, encoding="utf-8")
    return open_body("mujoco", "leg.xml", path, dt, substeps)


def refused(folder: Path, text: str = LEG, dt: float = 0.05, substeps: int | None = None) -> BodyError:
    with pytest.raises(BodyError) as caught:
        opened(folder, text, dt, substeps)
    return caught.value


def wave(body: Body, steps: int) -> list[list[float]]:
    """What is sensed while the leg moves to and fro."""
    result = []
    for k in range(steps):
        body.advance(0.05, np.array([np.sin(k), 0.2]))
        result.append(body.sense().tolist())
    return result


def test_sensors_and_actuators_are_those_with_names(tmp_path: Path) -> None:
    body = opened(tmp_path)
    assert [(port.name, port.size, port.unit) for port in body.sensors] == [
        ("place", 3, "m"),
        ("touch", 1, "N"),
        ("angle", 1, "rad"),
    ]
    assert [(port.name, port.size, port.unit, port.low, port.high) for port in body.actuators] == [
        ("hip", 1, "rad", -1.0, 1.0),
        ("push", 1, "N·m", -np.inf, np.inf),
    ]
    assert body.sense().tolist() == [0, 0, 0.5, 0, 0]
    body.advance(0.05, np.array([0.5, 0.0]))
    assert body.sense()[4] > 0.01, "sensors are those behind the step"


def test_a_body_begins_as_a_reset_leaves_it(tmp_path: Path) -> None:
    body = opened(tmp_path)
    first = wave(body, 5)
    body.reset(7)
    assert wave(body, 5) == first
    assert not body.ended


def test_the_first_keyframe_is_the_beginning(tmp_path: Path) -> None:
    key = '<keyframe><key qpos="0 0 2 1 0 0 0 0.25"/></keyframe></mujoco>'
    assert opened(tmp_path, LEG.replace("</mujoco>", key)).sense().tolist() == [0, 0, 2, 0, 0.25]


def test_a_state_is_restored_exactly(tmp_path: Path) -> None:
    body = opened(tmp_path)
    wave(body, 40)  # on the ground by now
    state, here = body.state(), body.sense().tolist()
    assert isinstance(state, np.ndarray)
    ahead = wave(body, 40)
    body.restore(state)
    assert body.sense().tolist() == here
    assert wave(body, 40) == ahead
    other = opened(tmp_path)
    other.restore(state)
    assert wave(other, 40) == ahead
    with pytest.raises(BodyError, match="no state of this model"):
        body.restore(np.zeros(3))


def test_what_falls_asleep_cannot_be_kept(tmp_path: Path) -> None:
    body = opened(tmp_path, LEG.replace('timestep="0.01"/>', 'timestep="0.01"><flag sleep="enable"/></option>'))
    with pytest.raises(BodyError, match="asleep"):
        body.state()


def test_of_several_touch_sensors_on_a_part_the_foot_is_at_its_end(tmp_path: Path) -> None:
    text = LEG.replace('<site name="tip"', '<site name="shin" pos="0.05 0 -0.2" size="0.03"/><site name="tip"')
    text = text.replace('<touch name="touch"', '<touch name="shin" site="shin"/><touch name="touch"')
    plain, felt = opened(tmp_path).skeleton, opened(tmp_path, text).skeleton
    assert plain is not None
    assert felt is not None
    assert len(felt.feet) == len(plain.feet)


def test_the_skeleton_says_which_points_the_actuators_move(tmp_path: Path) -> None:
    """Two at the hip, which is where the leg begins; a tendon moves no single point."""
    tendon = '<tendon><fixed name="rope"><joint joint="hip" coef="1"/></fixed></tendon><actuator>'
    text = LEG.replace("<actuator>", tendon).replace("</actuator>", '<motor name="pull" tendon="rope"/></actuator>')
    body = opened(tmp_path, text)
    skeleton, pose = body.skeleton, body.pose()
    assert skeleton is not None
    assert [port.name for port in body.actuators] == ["hip", "push", "pull"]
    first, second, third = skeleton.joints
    assert pose[3 * first : 3 * first + 3].round(9).tolist() == [0.2, 0.3, 0.5]
    assert (second, third) == (first, -1)


def test_the_skeleton_has_links_feet_and_solids(tmp_path: Path) -> None:
    body = opened(tmp_path)
    skeleton = body.skeleton
    assert skeleton is not None
    assert skeleton.points[skeleton.middle] == "base"
    pose = body.pose()
    assert pose.shape == (skeleton.size,)
    places = pose[: 3 * len(skeleton.points)].reshape(-1, 3)

    def ends(number: int) -> tuple[list[float], list[float], float]:
        link = skeleton.links[number]
        return places[link.start].round(9).tolist(), places[link.end].round(9).tolist(), round(link.radius, 9)

    assert skeleton.links[0].radius == 0, "a box lies between its corners"
    corners = places[list(skeleton.links[0].points)].round(9).tolist()
    assert sorted(corners) == [[x, y, z] for x in (-0.2, 0.2) for y in (-0.1, 0.1) for z in (0.45, 0.55)]
    assert sorted(ends(1)[:2]) == [[0.2, 0.3, 0.5], [0.3, 0.3, 0.1]]
    assert ends(3) == ([0, 0, 0.5], [0.2, 0.3, 0.5], 0.008), "the leg does not meet the box: a thin link leads there"
    assert len(skeleton.links) == 4, "the prop meets the box, if not the round end of what is drawn of it"
    assert [places[foot].round(9).tolist() for foot in skeleton.feet] == [[0.3, 0.3, 0.1], [-0.2, -0.02, 0.03]]
    assert pose[-2:].tolist() == [0, 0]
    (wall,) = skeleton.solids
    assert wall.low == pytest.approx((0, -0.1, 0))
    assert wall.high == pytest.approx((2, 0.1, 1))
    wave(body, 20)
    assert 1 in body.pose()[-2:], "it has fallen on a foot"


@pytest.mark.parametrize(
    ("geom", "high", "wide"),
    [
        ('type="box" size="0.3 0.1 0.02"', (0.3, 0.1, 0.02), 4),
        ('type="box" size="0.1 0.1 0.1"', (0.1, 0.1, 0.1), 4),
        ('type="ellipsoid" size="0.3 0.1 0.02"', (0.3, 0.1, 0.02), 25),
        ('type="cylinder" size="0.1 0.02"', (0.1, 0.1, 0.02), 16),
        ('type="mesh" mesh="octahedron"', (0.3, 0.2, 0.1), 3),
        ('type="capsule" size="0.02 0.3"', (0.02, 0.02, 0.32), 1),
        ('type="sphere" size="0.1"', (0.1, 0.1, 0.1), 1),
    ],
)
def test_a_part_reaches_as_far_as_it_does(
    tmp_path: Path, geom: str, high: tuple[float, float, float], wide: int
) -> None:
    text = LEG.replace('<geom type="box" size="0.2 0.1 0.05"/>', f"<geom {geom}/>")
    vertices = "0.3 0 0 -0.3 0 0 0 0.2 0 0 -0.2 0 0 0 0.1 0 0 -0.1 0.05 0.01 0"
    mesh = f'<asset><mesh name="octahedron" vertex="{vertices}"/></asset>'
    body = opened(tmp_path, text.replace("<worldbody>", f"{mesh}<worldbody>"))
    skeleton = body.skeleton
    assert skeleton is not None
    link, places = skeleton.links[0], body.pose()[: 3 * len(skeleton.points)].reshape(-1, 3)
    assert len(link.lines) == wide
    far = np.abs(places[list(link.points)] - (0, 0, 0.5)).max(axis=0) + link.radius
    assert far == pytest.approx(np.array(high), rel=0.02)


@pytest.mark.parametrize(
    "foot",
    [
        '<geom name="left_foot" size="0.03" pos="0 0 -0.45" contype="0" conaffinity="0"/>'
        '<geom size="0.03" pos="0 0 -0.45"/>',
        '<body name="left_foot" pos="0 0 -0.45"><geom size="0.03"/></body>',
        '<body name="left_foot" pos="0 0 -0.45"><body name="sole"><geom size="0.03"/></body></body>',
        '<body name="left_foot" pos="0 0 -0.45"><geom size="0.03" contype="0" conaffinity="0"/>'
        '<geom size="0.03"/></body>',
    ],
    ids=["seen alone", "body", "body around", "body with a shell"],
)
def test_a_foot_that_stands_touches_whatever_of_it_has_the_name(tmp_path: Path, foot: str) -> None:
    text = LEG.replace('<geom name="left_foot" type="capsule" fromto="0 0 0 0 0 -0.45" size="0.02"/>', foot)
    text = text.replace('<touch name="touch" site="tip"/>', "")
    body = opened(tmp_path, text.replace('pos="0 0 0.5">', 'pos="0 0 0.499">'))
    assert body.skeleton is not None
    assert len(body.skeleton.feet) == 1
    assert body.pose()[-1] == 1
    state = body.state()
    assert isinstance(state, np.ndarray)
    body.restore(np.where(np.arange(len(state)) == 3, 1.0, state))  # half a metre up
    assert body.pose()[-1] == 0


def test_steps_of_the_model_make_a_step_of_the_network(tmp_path: Path) -> None:
    opened(tmp_path, substeps=5)
    opened(tmp_path, dt=0.3, substeps=30)  # 30 * 0.01 is not quite 0.3
    error = refused(tmp_path, substeps=25)
    assert str(error) == "25 substeps are 0.25 s, a step of the network is 0.05 s; a step of the model is 0.01 s"
    assert (error.hint, error.key) == ("write substeps: 5", "substeps")
    error = refused(tmp_path, dt=0.054)
    assert "no number of substeps makes a step of the network, which is 0.054 s" in str(error)
    assert error.hint == "write time: {dt: 0.05} and substeps: 5"
    assert "leads nowhere" in str(refused(tmp_path, LEG.replace('"0.01"', '"0"')))
    assert "leads nowhere" in str(refused(tmp_path, LEG.replace('"0.01"', '"nan"')))


BROKEN = {
    "nothing": ("", "is no XML"),
    "open": ("<mujoco>", "is no XML"),
    "element": ("<mujoco><x/></mujoco>", "unrecognized element"),
    "massless": ("<mujoco><worldbody><body><freejoint/></body></worldbody></mujoco>", "mass and inertia"),
    "memory": ('<mujoco><size memory="9000G"/></mujoco>', "memory"),
    "deep": ("<mujoco>" + "<default>" * 600 + "</default>" * 600 + "</mujoco>", "nesting is too deep"),
    "itself": ('<mujoco><include file="leg.xml"/></mujoco>', "already included"),
    "entities": ('<!DOCTYPE x [<!ENTITY a "b">]><mujoco/>', "has a DOCTYPE"),
    "absolute": ('<mujoco><asset><mesh file="/etc/passwd"/></asset></mujoco>', "no path relative to the model"),
    "missing": ('<mujoco><asset><mesh name="m" file="none.stl"/></asset></mujoco>', "none.stl"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_broken_is_reported(tmp_path: Path, name: str) -> None:
    text, words = BROKEN[name]
    message = str(refused(tmp_path, text))
    assert words in message
    assert "\n" not in message


def test_what_takes_too_long_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kind, "SECONDS", 1)
    many = '<replicate count="100000000" offset="1 0 0"><geom size="1"/></replicate>'
    message = str(refused(tmp_path, f"<mujoco><worldbody>{many}</worldbody></mujoco>"))
    assert "MuJoCo cannot open it within 1 seconds and 8 GB of memory" in message or "has not made it" in message


def test_a_model_says_which_files_it_names(tmp_path: Path) -> None:
    folder = tmp_path / "model"
    (folder / "parts").mkdir(parents=True)
    (folder / "leg.xml").write_text(
        '<mujoco><compiler meshdir="shapes" texturedir="skins"/><include file="parts/foot.xml"/>'
        '<asset><texture fileright="sky.png"/></asset></mujoco>'
    )
    (folder / "parts" / "foot.xml").write_text(
        '<mujocoinclude><asset><mesh file="../toe.stl"/></asset></mujocoinclude>'
    )
    found = {os.path.relpath(path, folder) for path in kind.MujocoKind().files(folder / "leg.xml")}
    whole = folder / "leg.xml"
    whole.write_text(whole.read_text().replace("s/foot", "s\\foot"))
    assert {os.path.relpath(path, folder) for path in kind.MujocoKind().files(whole)} == found
    assert found == {"parts/foot.xml", "sky.png", "skins/sky.png", "toe.stl", "../toe.stl", "parts/toe.stl"}


@given(st.binary(max_size=60), st.integers(0, 10_000), st.integers(0, 60))
@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_no_text_is_too_odd_to_be_searched_for_files(tmp_path: Path, odd: bytes, at: int, less: int) -> None:
    whole = LEG.replace("<worldbody>", '<include file="leg.xml"/><worldbody>').encode()
    (tmp_path / "leg.xml").write_bytes(whole[: at % len(whole)] + odd + whole[at % len(whole) + less :])
    with suppress(BodyError):
        assert all(isinstance(place, Path) for place in kind.MujocoKind().files(tmp_path / "leg.xml"))


def test_a_command_that_is_no_number_and_a_simulation_that_fails(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    body = opened(tmp_path)
    with pytest.raises(BodyError, match="the command of 'push' is nan"):
        body.advance(0.05, np.array([0.0, np.nan]))
    with pytest.raises(BodyError, match="unstable") as caught:
        body.advance(5.0, np.array([0.0, 1e9]))
    assert caught.value.hint is not None
    assert capfd.readouterr() == ("", "")
    assert not Path("MUJOCO_LOG.TXT").exists()


def test_what_is_not_installed_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    import sys

    for name in [name for name in sys.modules if name.startswith("neurovis_bodies")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(BodyMissingError, match="MuJoCo") as caught:
        load_kind("mujoco")
    assert caught.value.hint == "pip install 'neurovis-spec[sim]'"
