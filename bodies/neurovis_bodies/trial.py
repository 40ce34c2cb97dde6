"""A trial of a model: opened and advanced by one step in a process of its own, before anybody relies on it.

In: the path of a file in MJCF, on the command line. Out: nothing, or what MuJoCo says against it, and a status. A
model that is broken or hostile may end the process, take all memory, or never be made: then that is this process, not
the one that asks. It is run by its path and imports nothing of ours.
"""

from __future__ import annotations

import sys

#: bytes, and seconds of the processor
MEMORY = 8 << 30
SECONDS = 20
REFUSED = 3


def main(path: str, seconds: int) -> int:
    """Try a model for so many seconds; the exit status."""
    try:
        import resource

        for what, most in ((resource.RLIMIT_AS, MEMORY), (resource.RLIMIT_CPU, seconds), (resource.RLIMIT_CORE, 0)):
            _, hard = resource.getrlimit(what)
            resource.setrlimit(what, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    except (ImportError, ValueError, OSError):
        pass  # a system that cannot limit a process
    import mujoco

    mujoco.set_mju_user_warning(lambda message: None)
    try:
        model = mujoco.MjModel.from_xml_path(path)
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data)
    except MemoryError:
        sys.stdout.write("it needs more memory than there is for a model")
        return REFUSED
    except Exception as error:
        sys.stdout.write(" ".join(str(error).split()))
        return REFUSED
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], int(sys.argv[2])))
