"""The table of functions: a row more is a function that all compute, that is checked, and that the manual explains."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: A function that nobody has: what is added to the table, and nothing else.
ROW = '''
    Function(
        "logit(x)", lambda x: math.log(x / (1.0 - x)) if 0 < x < 1 else math.nan, lambda x: np.log(x / (1.0 - x)),
        "np.log({0}/(1.0 - {0}))", "nv_logit({0})", ("1/(x*(1 - x))",),
        about="The logarithm of the odds.",
        undefined=(Undefined("takes the logit of what is no chance", "x <= 0 or x >= 1"),),
        helper="""static {real} nv_logit({real} x)
{{
    return log{s}(x / (1.0{s} - x));
}}""",
    ),
'''
ADDED = """
import importlib.util, json, sys, warnings
from pathlib import Path

spec = importlib.util.find_spec("neurovis_spec.language.expressions.functions")
text, end = Path(spec.origin).read_text(encoding="utf-8"), ")  # fmt: skip\\n#: All functions"
assert text.count(end) == 1
table = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
exec(compile(text.replace(end, ROW.lstrip("\\n") + end), spec.origin, "exec"), table.__dict__)

import neurovis_spec as nv
from neurovis_spec.cli.topics import text_of
from neurovis_spec.language.expressions.derivative import derivative
from neurovis_spec.language.expressions.evaluate import evaluate
from neurovis_spec.language.expressions.parser import parse
from neurovis_spec.manual.topics import find

SPEC = (
    "neurovis: 1\\nname: n\\ntime: {steps: 3}\\nactivations: {g: {value: 'VALUE'}}\\n"
    "inputs: {s: {values: [[0.25], [0.75], [1.5]]}}\\nneurons: {A: {activation: g, input: s}}\\n"
)

def ran(value, backend):
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        activity = nv.compile_text(SPEC.replace("VALUE", value)).run(backend=backend).activity
    return activity[:2, 0].tolist(), [str(one.message) for one in told]

print(json.dumps({
    "shows": [ran("logit(x)", backend) for backend in BACKENDS],
    "hidden": [ran("1 if logit(x) > 0 else 0", backend) for backend in BACKENDS],
    "manual": text_of(find("logit")),
    "slope": evaluate(derivative(parse("logit(y)"), "y"), {"y": 0.25}),
}))
"""


@pytest.mark.parametrize("backends", [("reference", "numpy"), pytest.param(("c",), marks=pytest.mark.compiler)])
def test_a_function_is_one_row(backends: tuple[str, ...]) -> None:
    code = f"ROW = {ROW!r}\nBACKENDS = {backends!r}\n{ADDED}"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    for values, _ in found["shows"]:
        assert values == pytest.approx([-1.0986122886681098, 1.0986122886681098], rel=1e-15)
    for values, told in found["hidden"]:
        assert values == [0.0, 1.0]
        assert [message.split(" at step 2")[0] for message in told] == [
            "the activation 'g' takes the logit of what is no chance for A"
        ]
    assert "logit(x)" in found["manual"]
    assert "The logarithm of the odds." in found["manual"]
    assert found["slope"] == pytest.approx(1 / (0.25 * 0.75))
