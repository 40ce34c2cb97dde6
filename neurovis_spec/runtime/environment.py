"""The environment of the programs that are started from here.

In: this process's. Out: the same, without what is for this process alone.
"""

from __future__ import annotations

import os


def for_others() -> dict[str, str]:
    """The environment of other programs. The wheels of ROS 2 have their own process look for libraries among theirs:
    no other program is to load these."""
    environment = dict(os.environ)
    if environment.pop("_ROS_WHEELS_BOOTSTRAP_COMPLETE", None) is not None:
        environment.pop("LD_LIBRARY_PATH", None)
    return environment
