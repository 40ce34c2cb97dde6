"""The command line: ``neurovis COMMAND …``.

In: arguments, files, standard input. Out: results on standard output, everything else on standard error, and an exit
status: 0 for success, 1 where the input is invalid, 2 for wrong usage, 128 and its number after a signal (130 after
Ctrl-C, 143 after SIGTERM), 141 where the reader of standard output has gone. One module a command; a command's module
is imported when it is called.
"""

from __future__ import annotations

import gc
import os
import sys

from neurovis_spec.interrupts import Ended, raise_at_signals


def main() -> None:
    """Run ``neurovis`` on the arguments of the process; ends it."""
    gc.set_threshold(200_000, 20, 100)  # a process that soon ends need not look for cycles all the time
    # pydantic would look for plug-ins in the metadata of every package installed; none has anything to do with a spec
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")
    try:
        raise_at_signals()
        from neurovis_spec.cli.commands import neurovis

        neurovis.main(prog_name="neurovis")
    except KeyboardInterrupt as error:  # while something was still being imported, or after the command has ended
        sys.exit(128 + (error.number if isinstance(error, Ended) else Ended().number))
    finally:
        gc.freeze()  # nor look through everything once more at its end
