"""Runs a command in a network of its own, with nothing but a loopback in it, where this machine allows that.

python tests/isolated.py COMMAND ...
"""

from __future__ import annotations

import fcntl
import os
import shutil
import socket
import struct
import subprocess
import sys

_WAYS = (("unshare", "--net"), ("unshare", "--map-root-user", "--net"))
_SIOCSIFFLAGS, _UP, _RUNNING = 0x8914, 0x1, 0x40


def main(command: list[str]) -> None:
    if command[:1] == ["--inside"]:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
            fcntl.ioctl(sock, _SIOCSIFFLAGS, struct.pack("16sh14x", b"lo", _UP | _RUNNING))
        os.execvp(command[1], command[1:])
    for way in _WAYS if shutil.which("unshare") else ():
        inside = [*way, sys.executable, __file__, "--inside"]
        if subprocess.run([*inside, "true"], capture_output=True, check=False).returncode == 0:
            os.execvp(inside[0], [*inside, *command])
    print("no network of its own is allowed here: the command runs in that of the machine", file=sys.stderr)
    os.execvp(command[0], command)


if __name__ == "__main__":
    main(sys.argv[1:])
