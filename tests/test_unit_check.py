"""Units as labels: what follows from formulas, which mistakes are seen, and that nothing else is taken for one."""

from __future__ import annotations

import json
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from small_specs import HEAD, compiled, network_of

from neurovis_spec.cli.commands import neurovis
from neurovis_spec.compiler.program import MODEL, RULE, SYNAPSE
from neurovis_spec.compiler.values.builtin import libraries
from neurovis_spec.compiler.values.units import sheet_of
from neurovis_spec.language.expressions.dimensions import read_units
from neurovis_spec.language.expressions.functions import FUNCTIONS
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.language.units import NUMBER, Unit, spelled, unit_of

TIME = "time: {dt: 0.01 ms}\n"
LIF = """\
models:
  lif:
    time: ms
    parameters:
      tau: {value: 20, unit: ms}
      R: {value: 100, unit: MOhm}
      El: {value: -65, unit: mV}
      Vt: {value: -50, unit: mV}
    ports: {current: {unit: nA}}
    state: {v: {initial: -65 mV, unit: mV, derivative: (El - v + R*current)/tau}}
    outputs: {above: v >= Vt, far: v - Vt}
    activity: step(v - Vt)
neurons: {A: {model: lif, bias: {current: 100 pA}, initial: {v: -0.06 V}}}
"""
ADEX = """\
models:
  adex:
    time: ms
    parameters:
      C: {value: 281, unit: pF}
      gL: {value: 30, unit: nS}
      EL: {value: -70.6, unit: mV}
      VT: {value: -50.4, unit: mV}
      DT: {value: 2, unit: mV}
      Vpeak: {value: -40.4, unit: mV}
      tau_w: {value: 144, unit: ms}
      a: {value: 4, unit: nS}
    let: {u: "min(v, Vpeak)"}
    state:
      v: {initial: EL, unit: mV, derivative: (gL*(EL - u) + gL*DT*exp((u - VT)/DT) - w + drive)/C}
      w: {unit: pA, derivative: (a*(u - EL) - w)/tau_w}
    activity: v
neurons: {A: {model: adex, bias: 500}}
"""
HODGKIN_HUXLEY = """\
models:
  squid:
    time: ms
    parameters:
      C: {value: 1, unit: uF/cm^2}
      gNa: {value: 120, unit: mS/cm^2}
      gK: {value: 36, unit: mS/cm^2}
      gL: {value: 0.3, unit: mS/cm^2}
      ENa: {value: 50, unit: mV}
      EK: {value: -77, unit: mV}
      EL: {value: -54.387, unit: mV}
    let:
      am: 0.1*(v + 40)/(1 - exp(-(v + 40)/10))
      bm: 4*exp(-(v + 65)/18)
      ah: 0.07*exp(-(v + 65)/20)
      bh: sigmoid((v + 35)/10)
      an: 0.1/exprel(-(v + 55)/10)
      bn: 0.125*exp(-(v + 65)/80)
    state:
      v: {initial: -65, unit: mV, derivative: (drive - gNa*m^3*h*(v - ENa) - gK*n^4*(v - EK) - gL*(v - EL))/C}
      m: {initial: 0.05, unit: "1", derivative: am*(1 - m) - bm*m}
      h: {initial: 0.6, unit: "1", derivative: ah*(1 - h) - bh*h}
      n: {initial: 0.32, unit: "1", derivative: an*(1 - n) - bn*n}
    activity: v
neurons: {A: {model: squid, bias: 10}}
"""
COBA = """\
models:
  coba:
    time: ms
    parameters:
      C: {value: 200, unit: pF}
      gL: {value: 10, unit: nS}
      EL: {value: -60, unit: mV}
      Ee: {value: 0, unit: mV}
      Ei: {value: -80, unit: mV}
      te: {value: 5, unit: ms}
      ti: {value: 10, unit: ms}
    ports: {excitatory: {unit: nS/ms}, inhibitory: sum}
    state:
      v: {initial: EL, unit: mV, derivative: (gL*(EL - v) + ge*(Ee - v) + gi*(Ei - v))/C}
      ge: {unit: nS, derivative: excitatory - ge/te}
      gi: {unit: nS, derivative: inhibitory - gi/ti}
    activity: v
synapses:
  alpha:
    time: ms
    parameters: {tau: {value: 5, unit: ms}, E: {value: 0, unit: mV}, s: {value: 9, unit: mV}}
    state:
      g: {unit: nS/ms, derivative: (e*h - g)/tau}
      h: {unit: nS/ms, derivative: (weight*sigmoid((pre.v - post.v)/s) - h)/tau}
    signal: g*(E - post.v)/(E - post.v)
neurons: {A: {model: coba, bias: {excitatory: 1}}, B: {model: coba}}
connections: {A -> B: {synapse: alpha, port: excitatory}}
"""
IZHIKEVICH = """\
models:
  izhi:
    time: ms
    parameters: {a: {value: 0.02, unit: 1/ms}, b: {value: 0.2, unit: 1/ms}}
    state:
      v: {initial: -65, unit: mV, derivative: 0.04*v^2 + 5*v + 140 - u + drive}
      u: {initial: -13, unit: mV/ms, derivative: a*(b*v - u)}
    activity: v
neurons: {A: {model: izhi, bias: 10}}
"""
MORRIS_LECAR = """\
models:
  barnacle:
    time: ms
    parameters:
      C: {value: 20, unit: µF/cm²}
      gCa: {value: 4.4, unit: mS/cm²}
      gK: {value: 8, unit: mS/cm²}
      gL: {value: 2, unit: mS/cm²}
      ECa: {value: 120, unit: mV}
      EK: {value: -84, unit: mV}
      EL: {value: -60, unit: mV}
      V1: {value: -1.2, unit: mV}
      V2: {value: 18, unit: mV}
      V3: {value: 2, unit: mV}
      V4: {value: 30, unit: mV}
      phi: {value: 0.04, unit: 1/ms}
    let:
      open: 0.5*(1 + tanh((v - V1)/V2))
      limit: 0.5*(1 + tanh((v - V3)/V4))
    state:
      v: {initial: -60.855, unit: mV, derivative: (drive - gCa*open*(v - ECa) - gK*w*(v - EK) - gL*(v - EL))/C}
      w: {initial: 0.0149, unit: "1", derivative: phi*cosh((v - V3)/(2*V4))*(limit - w)}
    activity: v
neurons: {A: {model: barnacle, bias: 90}}
"""
LEARNING = """\
rules:
  decaying:
    time: ms
    parameters: {tau: {value: 20, unit: ms}, rate: {value: 0.01, unit: 1/ms}}
    state: {trace: {derivative: (pre - trace)/tau}}
    weight: {derivative: rate*(trace*post - weight)}
neurons: {A: {bias: 1}, B: {}}
connections: {A -> B: {plasticity: decaying}}
"""
NOISY = """\
models:
  ou:
    time: ms
    parameters: {tau: {value: 10, unit: ms}, sd: {value: 1, unit: mV}, kick: {value: 1, unit: mV/ms^0.5}}
    state:
      x: {unit: mV, derivative: -x/tau, noise: sd*sqrt(2/tau)}
      y: {unit: mV, derivative: (x - y)/tau, noise: kick}
    outputs: {fast: dt/tau, angle: "atan2(x, y)", either: x if t > tau else y}
    activity: y
neurons: {A: {model: ou}}
"""
SPIKES = """\
models:
  cell:
    time: ms
    parameters:
      tau: {value: 20, unit: ms}
      te: {value: 5, unit: ms}
      El: {value: -60, unit: mV}
      Ee: {value: 0, unit: mV}
      Vt: {value: -50, unit: mV}
      Vr: {value: -60, unit: mV}
      rest: {value: 5, unit: ms}
    ports: [excitatory, kicks, current]
    state:
      v: {initial: El, unit: mV, derivative: (El - v + ge*(Ee - v) + drive + current/gL)/tau, jump: kicks}
      ge: {unit: "1", derivative: -ge/te, jump: excitatory}
    let: {gL: "1"}
    spike: {when: v >= Vt, set: {v: Vr}, refractory: rest, hold: v}
synapses:
  expo:
    time: ms
    parameters: {tau: {value: 5, unit: ms}, E: {value: 3, unit: mV}}
    state: {g: {unit: nS, derivative: -g/tau, on_pre: g + weight}}
    signal: g*(E - post.v)
rules:
  stdp:
    time: ms
    parameters:
      tau_pre: {value: 20, unit: ms}
      tau_post: {value: 20, unit: ms}
      up: {value: 0.01, unit: nS}
      down: {value: 0.0105, unit: nS}
    state:
      a: {derivative: -a/tau_pre, on_pre: a + up}
      b: {derivative: -b/tau_post, on_post: b - down}
    weight: {on_pre: weight + b, on_post: weight + a}
neurons: {A: {model: cell, bias: 20, count: 2}}
connections: {A1 -> A2: {synapse: expo, plasticity: stdp, port: current}}
"""
#: Specs whose labels are right, whole and in part.
RIGHT = {
    "LIF": LIF, "AdEx": ADEX, "Hodgkin-Huxley": HODGKIN_HUXLEY, "COBA": COBA, "Izhikevich": IZHIKEVICH,
    "Morris-Lecar": MORRIS_LECAR, "a rule": LEARNING, "noise": NOISY,
    "spikes": SPIKES,
}  # fmt: skip
#: Mistakes: the spec, what is right there and what is written in its place, and words of what is said; "" where nothing
#: is.
MISTAKES = [
    (ADEX, "tau_w: {value: 144, unit: ms}", "tau_w: {value: 0.144, unit: s}", "tau_w in s: w' is in pA/s, its state"),
    (ADEX, "C: {value: 281, unit: pF}", "C: {value: 0.281, unit: nF}", "C in nF: v' is in mV/s, its state in mV"),
    (ADEX, "exp((u - VT)/DT)", "exp(u - VT)", "exp() is of a number, and u - VT is in mV"),
    (ADEX, "a: {value: 4, unit: nS}", "a: {value: 4, unit: uS}", "a*(u - EL) is in nA, w in pA"),
    (ADEX, "(a*(u - EL) - w)/tau_w", "a*(u - EL) - w/tau_w", "w/tau_w"),
    (ADEX, "drive)/C}", "drive)}", "v' is in pA"),
    (ADEX, "Vpeak: {value: -40.4, unit: mV}", "Vpeak: {value: -0.0404, unit: V}", "in V"),
    (LIF, "(El - v + R*current)/tau", "(El - v + current)/tau", "current is in nA, El in mV"),
    (LIF, "R: {value: 100, unit: MOhm}", "R: {value: 0.1, unit: GOhm}", "R*current is in V, El in mV"),
    (LIF, "tau: {value: 20, unit: ms}", "tau: {value: 0.02, unit: s}", "tau in s: v' is in mV/s, its state in mV"),
    (LIF, "time: ms", "time: s", "v' is in mV/ms, its state in mV per s"),
    (LIF, "above: v >= Vt", "above: v >= tau", "tau is in ms"),
    (COBA, "gi*(Ei - v)", "gi*Ei - v", "v is in mV"),
    (COBA, "excitatory - ge/te", "excitatory - ge", "ge is in nS, excitatory in nS/ms"),
    (COBA, "(gL*(EL - v) +", "(gL*(v/EL) +", "gL*(v/EL) is in nS"),
    (COBA, "g*(E - post.v)/(E - post.v)", "g*(E - post.v)", "brings"),
    (IZHIKEVICH, "u: {initial: -13, unit: mV/ms,", "u: {initial: -13, unit: mV,", "u"),
    (IZHIKEVICH, "a*(b*v - u)", "b*v - u", "u' is in mV/ms"),
    (HODGKIN_HUXLEY, "gK*n^4*(v - EK)", "gK*n^4", "gK*n^4 is in mS/cm^2"),
    (HODGKIN_HUXLEY, "gL: {value: 0.3, unit: mS/cm^2}", "gL: {value: 0.3, unit: mS}", "gL*(v - EL)"),
    (MORRIS_LECAR, "tanh((v - V3)/V4)", "tanh(v - V3/V4)", "V3/V4 a number without unit"),
    (MORRIS_LECAR, "phi*cosh", "cosh", ""),
    (SPIKES, "set: {v: Vr}", "set: {v: rest}", "v is in mV, its 'set' in ms"),
    (SPIKES, "when: v >= Vt", "when: v >= tau", "tau is in ms, v in mV"),
    (SPIKES, "rest: {value: 5, unit: ms}", "rest: {value: 0.005, unit: s}", "rest in s: the refractory time is in s"),
    (SPIKES, "on_pre: g + weight", "on_pre: g + tau", "tau is in ms, g in nS"),
    (SPIKES, "on_pre: a + up", "on_pre: a + up*tau_pre", "a is in pF, weight in nS"),
    (SPIKES, "on_post: weight + a", "on_post: weight + tau_pre", "weight in ms"),
    (NOISY, "noise: sd*sqrt(2/tau)", "noise: sd", "the noise of x is in mV, its state in mV per root of ms"),
    (NOISY, "x if t > tau else y", "x if t > tau else t", "t is in ms"),
]  # fmt: skip


def told(text: str) -> list[str]:
    """The warnings of units of a spec without its head."""
    return [found.message for found in compiled(TIME + text).warnings if found.code == "unit"]


def unlabelled(text: str) -> Iterator[str]:
    """The spec without one of its units each."""
    lines = text.split(", unit: ")
    for number in range(1, len(lines)):
        end = min(place for mark in ",}" if (place := lines[number].find(mark)) >= 0)
        yield (
            ", unit: ".join(lines[:number])
            + lines[number][end:]
            + "".join(f", unit: {one}" for one in lines[number + 1 :])
        )


@pytest.mark.parametrize("name", RIGHT)
def test_what_is_right_is_not_warned_of(name: str) -> None:
    assert told(RIGHT[name]) == []
    for text in unlabelled(RIGHT[name]):
        assert told(text.replace("-65 mV", "-65").replace("-0.06 V", "-60").replace("100 pA", "0.1")) == []


def test_the_library_has_no_mistake() -> None:
    for library in libraries():
        for kind in (MODEL, RULE, SYNAPSE):
            for name, model in library.definitions[kind.section].items():
                assert sheet_of(kind, name, model).faults == (), name


@pytest.mark.parametrize(("text", "right", "wrong", "words"), MISTAKES)
def test_a_mistake_is_seen(text: str, right: str, wrong: str, words: str) -> None:
    assert right in text
    found = told(text.replace(right, wrong))
    assert bool(found) == bool(words), "a rate that is left out of what has no unit is not seen: one of 1 may be meant"
    assert not words or any(words in message for message in found)


def test_units_change_no_hash() -> None:
    for text in unlabelled(MORRIS_LECAR):
        assert network_of(TIME + text).hash == network_of(TIME + MORRIS_LECAR).hash


def test_without_units_nothing_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("neurovis_spec.compiler.checks.units.check_units", None)
    network_of(
        TIME + "models: {m: {state: {v: {derivative: drive - v}}, activity: v}}\nneurons: {A: {model: m, bias: 1}}\n"
    )
    with pytest.raises(TypeError):
        network_of(TIME + LIF)


AT_ENDS = """\
models:
  volts:
    parameters: {{s: {{value: 1, unit: s}}}}
    state: {{v: {{unit: {source}, derivative: drive - v/s}}}}
    activity: v
  cell: {{ports: {{I: {{unit: pA}}}}, state: {{v: {{unit: mV, derivative: drive + 0*I}}}}, activity: v}}
synapses:
  gap: {{parameters: {{g: {{value: 1, unit: nS}}}}, signal: weight*g*({read} - post.v)}}
neurons: {{A: {{model: volts, bias: 1}}, B: {{model: cell}}, C: {{model: cell}}}}
connections:
- A -> B: {{synapse: {synapse}, port: I}}
- C -> B: {{synapse: {synapse}, port: I}}
"""


def test_units_at_the_ends_of_connections_are_known_where_they_are_in_use() -> None:
    plain = {"source": "mV", "read": "pre.v", "synapse": "gap"}
    assert told(AT_ENDS.format(**plain)) == []
    for read in ("pre.v", "pre", "pre.activity"):
        found = told(AT_ENDS.format(**plain | {"source": "V", "read": read}))
        assert found == [f"post.v is in mV, {read} in V"]
    builtin = compiled(TIME + AT_ENDS.format(**plain | {"source": "V", "synapse": "gap_junction"}))
    (one,) = (found for found in builtin.warnings if found.code == "unit")
    assert one.message == "in the synapse 'gap_junction' post.v is in mV, pre.v in V"
    assert one.span.line == 14


SET = """\
parameters: {{tau_m: {{value: 20, unit: {unit}}}, Cm: {{value: 1, unit: uF/cm^2}}, q: 3, w: {{value: 1, unit: gulps}}}}
models:
  lif:
    time: ms
    parameters: {{tau: {{value: 20, unit: ms}}}}
    state: {{v: {{derivative: (drive - v)/tau}}}}
    activity: v
modules:
  leg:
    parameters: {{slow: {{value: 1, unit: {unit}}}}}
    neurons: {{B: {{model: {{lif: {{tau: slow}}}}}}}}
instances: {{left: {{module: leg}}}}
neurons:
  A: {{model: {{lif: {{tau: {tau}}}}}, bias: 0*q*w*tau_m*Cm}}
  H: {{model: {{hodgkin_huxley: {{C: {C}}}}}}}
"""


def test_what_parameters_are_set_to_is_in_their_unit() -> None:
    right = {"unit": "ms", "tau": "tau_m", "C": "Cm"}
    assert told(SET.format(**right)) == []
    for tau in ("2*tau_m", "q*tau_m", "w*tau_m", "20 ms", "3", '"max(tau_m, 3)"', "[20 ms]"):
        assert told(SET.format(**right | {"tau": tau})) == []
    assert told(SET.format(**right | {"unit": "s"})) == [
        "slow in s: tau of lif is in ms, and is set to what is in s",
        "tau_m in s: tau of lif is in ms, and is set to what is in s",
    ]
    assert told(SET.format(**right | {"tau": "tau_m + Cm"})) == ["Cm is in uF/cm^2, tau_m in ms"]
    assert told(SET.format(**right | {"C": "tau_m"})) == [
        "C of hodgkin_huxley is in µF/cm², and is set to what is in ms"
    ]


GIVEN = """\
parameters: {{lag: {{value: 1, unit: {lag}}}, often: {{value: 9, unit: {often}}}, V: {{value: 1, unit: {V}}},
  I: {{value: 1, unit: {I}}}}}
inputs: {{rain: {{poisson: often if t > 0.1 else 0}}}}
models:
  cell:
    time: ms
    parameters: {{C: {{value: 2, unit: nF}}, tau: {{value: 20, unit: ms}}}}
    ports: {{kick: {{unit: mV}}}}
    state: {{v: {{unit: mV, derivative: drive/C - v/tau, jump: kick}}}}
    activity: v
neurons:
  A: {{count: 2, model: cell, input: {{kick: rain}}, initial: {{v: [V, "uniform(-V, V)"]}}}}
  B: {{count: 2, model: cell, initial: {{v: -V}}, bias: {{drive: I, kick: 3}}}}
connections: {{A -> B: {{pattern: one_to_one, delay: {{seconds: lag + 0.001*pre.tau}}}}}}
"""


def test_what_neurons_begin_with_and_are_given_is_in_their_units() -> None:
    right = {"lag": "s", "often": "Hz", "V": "mV", "I": "nA"}
    assert told(GIVEN.format(**right)) == []
    for name, unit, *messages in (
        ("lag", "ms", "lag in ms: the delay of A -> B is in s, and is set to what is in ms"),
        ("often", "kHz", "often in kHz: the rate of rain is in 1/s, and is set to what is in kHz"),
        ("V", "V", *["V in V: v of cell is in mV, and is set to what is in V"] * 3),
        ("I", "pA", "I in pA: drive of cell is in nA, and is set to what is in pA"),
    ):
        assert told(GIVEN.format(**right | {name: unit})) == messages


#: How a function changes where its arguments do by a factor, by how units go through it.
DEGREES = {"same": 1.0, "compared": 0.0, "sign": 0.0, "root": 0.5}
#: These round to whole numbers in whatever unit they are given, and so are not exact in this.
ROUNDING = {"floor", "ceil", "round"}


@given(st.data())
def test_a_function_changes_with_its_arguments_as_their_units_do(data: st.DataObject) -> None:
    known = [row for row in FUNCTIONS.values() if row.units in DEGREES and row.name not in ROUNDING]
    row = data.draw(st.sampled_from(known))
    numbers = data.draw(st.lists(st.floats(0.001, 1000), min_size=row.least, max_size=row.most or 4))
    factor = data.draw(st.sampled_from([0.25, 4.0, 16.0]))
    scaled = row.scalar(*(factor * number for number in numbers))
    assert scaled == pytest.approx(factor ** DEGREES[row.units] * row.scalar(*numbers), rel=1e-12)


KNOWN = {name: unit for name in ("mV", "ms", "nS", "pF") if (unit := unit_of(name)) is not None}
PAIRS = st.sampled_from(sorted(KNOWN))


@given(PAIRS, PAIRS, st.sampled_from(["{a}*{b}/{b}", "{b}/({b}/{a})", "({a}^2)^0.5", "sqrt({a}*{a})", "-abs({a})"]))
def test_what_formulas_leave_is_the_unit_that_they_began_with(a: str, b: str, form: str) -> None:
    tree = parse(form.format(a=a, b=b))
    assert read_units(tree, KNOWN).unit == KNOWN[a]
    # and where that of one name alone is not known it follows
    alone = {name: unit for name, unit in KNOWN.items() if name != b}
    if a != b and form.startswith("{b}"):
        assert read_units(parse(f"{a}*{b}"), alone, [b], NUMBER).deduced == {b: NUMBER / KNOWN[a]}


POWERS = st.lists(st.integers(-3, 3), min_size=8, max_size=8)


@given(POWERS, st.lists(st.sampled_from(["mV", "pA", "nS/ms", "µF/cm²"]), max_size=2))
def test_a_unit_is_told_so_that_it_can_be_read(powers: list[int], words: list[str]) -> None:
    unit = Unit(tuple(map(Fraction, powers)))
    assert unit_of(spelled(unit, words)) == unit


def test_a_factor_is_told_as_one_however_large_it_is() -> None:
    """``s/ms`` is no unit of a number; and 10 to the power of what is written is not worked out."""
    inner = "{parameters: {a: {value: 1, unit: mV}, b: {value: 1, unit: V}}, let: {x: WRITTEN}, activity: x}"
    text = f"models: {{m: {inner}}}\nneurons: {{A: {{model: m}}}}"
    for written, message in (
        ("log(b/a)", "log() is of a number, and b/a is 10^3 times a number"),
        ("a^99999999 + b^99999999", "b^99999999 is in V^99999999, a^99999999 in 10^-299999997·V^99999999"),
    ):
        assert told(text.replace("WRITTEN", written)) == [message]


UNREAD = ("furlong", "mV/", "m V%", "mol/(m^3)", "V^x", "2 mV", "")


@pytest.mark.parametrize("text", UNREAD)
def test_another_unit_is_but_a_label(text: str) -> None:
    assert unit_of(text) is None


def test_what_is_derived_is_printed(tmp_path: Path) -> None:
    spec = tmp_path / "spec.yaml"
    spec.write_text(f"{HEAD}{TIME}{COBA}", encoding="utf-8")
    done = CliRunner().invoke(neurovis, ["validate", str(spec), "--units"])
    assert done.exit_code == 0
    lines = [" ".join(line.split()) for line in done.stdout.splitlines()]
    for line in (
        "port inhibitory nS/ms derived",
        "state ge nS",
        "reads post.v mV derived",
        "reads weight nS/ms derived",
    ):
        assert line in lines
    assert "synapse alpha" in lines
    made = json.loads(CliRunner().invoke(neurovis, ["validate", str(spec), "--units", "--format", "json"]).stdout)
    assert made["findings"] == []
    rows = {(row["definition"], row["name"]): (row["part"], row["unit"], row["how"]) for row in made["units"]}
    assert rows["coba", "inhibitory"] == ("port", "nS/ms", "derived")
    assert rows["alpha", "g"] == ("state", "nS/ms", "declared")
    refused = CliRunner().invoke(neurovis, ["validate", str(spec), "--units", "--format", "sarif"])
    assert refused.exit_code == 2
