# From a fresh clone, with Python 3.11 or later and nothing else of ours:
#
#   make demo       makes .venv, installs, and runs the main job into demo/
#   make walk       the same for a hexapod that learns to walk in a simulation; installs mujoco
#   make test       every check that needs Python alone
#   make gallery    draws the examples into docs/pictures and writes docs/gallery.md; needs graphviz' dot
#   make test-all   what needs Chromium, graphviz' dot, gcc and g++, node, or starts a cluster, and test-ros; fails without
#   make test-ros   the tests with ROS: ROS 1 of Debian, and ROS 2 (Kilted, Jazzy) as wheels, installed into .ros
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
ELSEWHERE := browser or dot or compiler or cluster or node

.PHONY: help install demo walk gallery test test-all test-elsewhere test-ros needs needs-ros fuzz layouts docs page page-check format clean
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

test: $(VENV)/tested
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m pytest -n auto -m "not ($(ELSEWHERE) or ros)" $(PYTEST_ARGS)

test-all: test-elsewhere test-ros

test-elsewhere: needs $(VENV)/tested page-check
	$(BIN)/python -m pytest -m "$(ELSEWHERE)" $(PYTEST_ARGS)

# Each ROS is in an environment of its own, in which NeuroVis is used in place.
test-ros: needs-ros $(VENV)/tested .ros/one/made .ros/kilted/made .ros/jazzy/made
	$(BIN)/python tests/isolated.py $(BIN)/python -m pytest -m ros $(wildcard tests/test_ros*.py) $(PYTEST_ARGS)

# The commands are those of docs/ros.md, whose python3 is the one of .venv.
.ros/%/made: $(VENV)/made docs/ros.md pyproject.toml
	@echo "installing into .ros/$*, as docs/ros.md does"
	@PATH="$(CURDIR)/$(BIN):$$PATH" PIP_QUIET=1 PIP_DISABLE_PIP_VERSION_CHECK=1 $(BIN)/python tests/ros_page.py $* --install
	@touch $@

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
	rm -rf $(VENV) node_modules demo build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
