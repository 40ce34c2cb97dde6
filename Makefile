# From a fresh clone, with Python 3.11 or later and nothing else of ours:
#
#   make demo       makes .venv, installs, and runs the main job into demo/
#   make walk       the same for a hexapod that learns to walk in a simulation; installs mujoco
#   make test       every check that needs Python alone
#   make gallery    draws the examples into docs/pictures and writes docs/gallery.md; needs graphviz' dot
#   make test-all   what needs Chromium, graphviz' dot, gcc and g++, node, or starts a cluster, and test-ros; fails without
#   make test-browsers, test-compilers   the parts of it that need Chromium and node, and the others but for ROS
#   make test-ros   the tests with ROS: ROS 1 of Debian, and ROS 2 (Kilted, Jazzy) as wheels, installed into .ros
#   make test-lowest   every command once, with the oldest packages that pyproject.toml allows, in .pythons/lowest
#   make test-pythons  every command once with Python 3.13, and the tests of reading with it and /usr/bin/python3
#   make fuzz       20,000 broken specs and 5,000 expressions (FUZZ_ARGS=... for more), two or three minutes
#   make layouts    layouts beside dot's, ELK's, sfdp's and networkx' (LAYOUTS_ARGS="--all --graphs FOLDER" for more)
#   make docs       writes the generated parts of docs/ anew
#   make page       puts the page of the live view together from its modules; needs node and npm
#   make page-check checks its JavaScript: types and lint, and that the page is up to date; needs node and npm
#
# PYTHON=... names another interpreter to make .venv with, PYTEST_ARGS=... adds to pytest's arguments.

PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11; do \
  $$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
PYTEST_ARGS ?=

VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
NPM := npm --no-audit --no-fund --no-package-lock --loglevel=error
BROWSERS := browser or node
COMPILERS := dot or compiler or cluster

# What is compiled once is kept: else each process that a test starts compiles all of it anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help install demo walk gallery test test-all test-browsers test-compilers test-ros test-lowest test-pythons test-3.13 test-system needs needs-ros fuzz layouts docs page page-check format clean
.DELETE_ON_ERROR:

help:
	@sed -n '/^#/!q; s/^# \{0,1\}//p' Makefile

# The stamps lie in .venv, so that they go when it goes. A package is reinstalled when what it needs may have changed;
# the code itself is used in place.

$(VENV)/made:
	@test -n "$(PYTHON)" || { echo "NeuroVis needs Python 3.11 or later: install it, or say PYTHON=/path/to/python" >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) || { echo "$(PYTHON) -m venv failed; on Debian: apt-get install python3-venv" >&2; exit 1; }
	@touch $@

# pip compiles what it copies; what is used in place is compiled here, so that commands start as quickly.
$(VENV)/installed: $(VENV)/made pyproject.toml
	@echo "installing into $(VENV) with $$($(BIN)/python --version) (a minute or so)"
	@begun=$$(date +%s); $(PIP) --editable . && printf '%-26s%5s s   %s\n' install $$(($$(date +%s) - begun)) $(VENV)
	@$(BIN)/python -m compileall -q neurovis_spec layouts renderers bodies
	@touch $@

$(VENV)/tested: $(VENV)/installed
	@echo "installing what the tests need"
	@$(PIP) --editable '.[test]'
	@touch $@

install: $(VENV)/installed

demo: $(VENV)/installed
	@$(BIN)/python demo.py

$(VENV)/simulated: $(VENV)/installed
	@echo "installing what bodies are simulated with"
	@$(PIP) --editable '.[sim]'
	@touch $@

walk: $(VENV)/simulated
	@$(BIN)/python demo.py walk

gallery: $(VENV)/simulated
	@$(BIN)/python gallery.py

# Types are checked while the tests run, and told after them. Workers take tests that stand beside each other, which share
# what is made for a file.
test: $(VENV)/tested
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	@$(BIN)/mypy >$(VENV)/types 2>&1 & types=$$!; trap 'kill $$types 2>/dev/null; exit 130' INT TERM HUP; failed=0; \
	echo '$(BIN)/mypy, beside the tests'; \
	$(BIN)/python -m pytest -n auto --dist worksteal -m "not ($(BROWSERS) or $(COMPILERS) or ros)" $(PYTEST_ARGS) || failed=1; \
	wait $$types || failed=1; echo '$(BIN)/mypy'; cat $(VENV)/types; exit $$failed

test-all: test-browsers test-compilers test-ros

test-browsers: needs $(VENV)/tested page-check
	$(BIN)/python -m pytest -m "$(BROWSERS)" $(PYTEST_ARGS)

test-compilers: needs $(VENV)/tested
	$(BIN)/python -m pytest -m "($(COMPILERS)) and not ($(BROWSERS))" $(PYTEST_ARGS)

# Each ROS is in an environment of its own, in which NeuroVis is used in place.
test-ros: needs-ros $(VENV)/tested .ros/one/made .ros/kilted/made .ros/jazzy/made
	$(BIN)/python tests/isolated.py $(BIN)/python -m pytest -m ros $(wildcard tests/test_ros*.py) $(PYTEST_ARGS)

# The commands are those of docs/ros.md, whose python3 is the one of .venv.
.ros/%/made: $(VENV)/made docs/ros.md pyproject.toml
	@echo "installing into .ros/$*, as docs/ros.md does"
	@PATH="$(CURDIR)/$(BIN):$$PATH" PIP_QUIET=1 PIP_DISABLE_PIP_VERSION_CHECK=1 $(BIN)/python tests/ros_page.py $* --install
	@touch $@

# Other environments, each with a folder in .pythons. uv installs the oldest packages, which pip cannot, and the others
# as quickly; what tests/smoke.py calls needs every extra.

READING := $(patsubst %,tests/test_%.py,reader contract_yaml contract_includes written_text expressions errors repair fmt fmt_edit)
NAMES_OF_EXTRAS := import tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"], sep=",")
EXTRAS = $(shell $(PYTHON) -c '$(NAMES_OF_EXTRAS)')
PYTHON_313 = $(shell for p in python3.13 $$HOME/.pyenv/versions/3.13*/bin/python; do \
  $$p -c 'import sys; sys.exit(sys.version_info[:2] != (3, 13))' 2>/dev/null && echo $$p && break; done)
# Debian's own Python, where it is another one than that of .venv and can run NeuroVis
PYTHON_SYSTEM = $(shell test "$$(/usr/bin/python3 -VV)" != "$$($(BIN)/python -VV)" \
  && /usr/bin/python3 -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo /usr/bin/python3)

# The oldest packages have no wheels for the newest Pythons.
PYTHON_OLDEST = $(shell for p in python3.11 python3.12 $(PYTHON); do $$p -c '' 2>/dev/null && echo $$p && break; done)

# $(call environment,NAME,PYTHON,WHAT) makes .pythons/NAME with a Python, and installs WHAT there.
environment = echo "installing into .pythons/$(1), with $$($(2) --version)" && rm -rf .pythons/$(1) && $(2) -m venv .pythons/$(1) \
  && .pythons/$(1)/bin/python -m pip install --quiet --disable-pip-version-check uv \
  && .pythons/$(1)/bin/uv pip install --quiet --python .pythons/$(1)/bin/python $(3) && touch $@

.pythons/lowest/made: pyproject.toml
	@$(call environment,lowest,$(PYTHON_OLDEST),--resolution lowest-direct --editable '.[$(EXTRAS)]')

.pythons/3.13/made: pyproject.toml
	@$(call environment,3.13,$(PYTHON_313),--editable '.[$(EXTRAS)]')

.pythons/system/made: pyproject.toml
	@$(call environment,system,$(PYTHON_SYSTEM),--editable '.[sim]' pytest hypothesis jsonschema)

test-lowest: .pythons/lowest/made
	.pythons/lowest/bin/python -m pytest tests/smoke.py $(PYTEST_ARGS)

test-pythons: $(VENV)/made
	@failed=0; \
	if test -n "$(PYTHON_313)"; then $(MAKE) --no-print-directory test-3.13 || failed=1; \
	else echo "Python 3.13 is not tried: there is no python3.13 on the PATH, and none that pyenv has made"; fi; \
	if test -n "$(PYTHON_SYSTEM)"; then $(MAKE) --no-print-directory test-system || failed=1; \
	else echo "/usr/bin/python3 is not tried: it is that of $(VENV), older than 3.11, or not there"; fi; \
	exit $$failed

test-3.13: .pythons/3.13/made
	.pythons/3.13/bin/python -m pytest tests/smoke.py $(READING) $(PYTEST_ARGS)

test-system: .pythons/system/made
	.pythons/system/bin/python -m pytest $(READING) $(PYTEST_ARGS)

# Skipping would hide that nothing was tested: what is missing is an error.
needs:
	@missing=; \
	for browser in chromium chromium-browser google-chrome; do command -v $$browser >/dev/null && break; done \
	  || missing="$$missing Chromium (apt-get install chromium);"; \
	command -v dot >/dev/null || missing="$$missing dot (apt-get install graphviz);"; \
	command -v npm >/dev/null || missing="$$missing node and npm (apt-get install nodejs npm);"; \
	command -v gcc >/dev/null || missing="$$missing a C compiler (apt-get install gcc libc6-dev);"; \
	command -v g++ >/dev/null || missing="$$missing a C++ compiler (apt-get install g++);"; \
	test -z "$$missing" || { echo "make test-all needs what is not here:$$missing" >&2; exit 1; }

node_modules/made: package.json
	@echo "installing what checks the page's JavaScript and reads recordings"
	@$(NPM) install --silent
	@touch $@

page-check: $(VENV)/tested node_modules/made
	$(NPM) run --silent check
	$(BIN)/python neurovis_spec/live/page/build.py --check

ROS_1 := python3-roslaunch python3-rosmaster python3-rospy python3-rostopic python3-rosbag python3-rosparam \
  python3-std-msgs python3-sensor-msgs ros-std-msgs ros-sensor-msgs rosout
CPP_1 := libroscpp-dev libsensor-msgs-dev libgeometry-msgs-dev libstd-msgs-dev libdiagnostic-msgs-dev g++ pkg-config python3-rosnode

needs-ros:
	@/usr/bin/python3 -c 'import rosmaster, rospy, std_msgs.msg, sensor_msgs.msg' 2>/dev/null \
	  && (for command in roscore rosmaster rostopic rosbag rosparam g++ pkg-config; do command -v $$command >/dev/null || exit 1; done) \
	  && pkg-config --exists roscpp sensor_msgs \
	  || { echo "make test-ros needs what is not here: ROS 1 (apt-get install $(ROS_1))" >&2; exit 1; }
	@for command in ip unshare nsenter; do PATH="$$PATH:/usr/sbin:/sbin" command -v $$command >/dev/null \
	  || { echo "make test-ros needs what is not here: two machines on one (apt-get install iproute2 util-linux)" >&2; exit 1; }; done
	@command -v g++ >/dev/null && command -v rosnode >/dev/null && pkg-config --exists roscpp 2>/dev/null \
	  && test -e /usr/include/sensor_msgs/JointState.h -a -e /usr/include/geometry_msgs/TwistStamped.h \
	    -a -e /usr/include/diagnostic_msgs/DiagnosticArray.h \
	  || { echo "make test-ros needs what is not here: ROS 1 for C++ (apt-get install $(CPP_1))" >&2; exit 1; }
	@test "$$(uname -sm)" = "Linux x86_64" || { echo "make test-ros needs Linux on x86_64: there are no wheels of ROS 2 for others" >&2; exit 1; }

fuzz: $(VENV)/tested
	$(BIN)/python benchmarks/fuzzing.py $(FUZZ_ARGS)

layouts: $(VENV)/tested
	$(BIN)/python benchmarks/layout.py $(LAYOUTS_ARGS)
	$(BIN)/python benchmarks/layout_promises.py
	$(BIN)/python benchmarks/readability.py

docs: $(VENV)/installed
	$(BIN)/python docs/make_language.py
	$(BIN)/python -m neurovis_spec.codes > docs/errors.md
	$(BIN)/python -m neurovis_spec.analysis > docs/measures.md

page: $(VENV)/tested node_modules/made
	$(BIN)/python neurovis_spec/live/page/build.py

format: $(VENV)/tested
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf $(VENV) .pythons node_modules demo build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
