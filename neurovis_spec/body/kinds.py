"""Bodies are opened by the name of their kind, through entry points.

In: what a spec says of its body. Out: the Body, or a BodyError in the words of whoever asked. No kind is imported
before somebody has a body of it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final, cast

from neurovis_spec import plugins
from neurovis_spec.body.model import Body, BodyError, BodyKind

#: What our own kinds need besides, and what installs it.
_NEEDS: Final = {"mujoco": "MuJoCo", "gymnasium": "Gymnasium"}


class BodyMissingError(BodyError):
    """What a kind of body needs is not installed."""


def load_kind(name: str) -> BodyKind:
    """A kind of bodies by its name. Raises BodyError, BodyMissingError where what it needs is not installed."""
    try:
        loaded = plugins.load(plugins.BODIES, name)
    except KeyError:
        raise BodyError(f"there is no kind of body '{name}'") from None
    except plugins.PluginError as error:
        if isinstance(error.__cause__, ImportError):
            message = f"a body of {_NEEDS.get(name, name)} needs what is not installed ({error.__cause__})"
            hint = "pip install 'neurovis-spec[sim]'" if name in _NEEDS else None
            raise BodyMissingError(message, hint, name) from None
        raise BodyError(str(error), key=name) from None
    if not all(hasattr(loaded, part) for part in ("takes_file", "files", "open")):
        raise BodyError(f"the plug-in '{name}' opens no bodies: it has not all that a BodyKind has", key=name)
    return cast(BodyKind, loaded)


def open_body(kind: str, given: str, path: Path | None, dt: float, substeps: int | None) -> Body:
    """A body of a kind, at its beginning. Raises BodyError, BodyMissingError where what it needs is not installed."""
    loaded = load_kind(kind)
    try:
        return loaded.open(given, path, dt, substeps)
    except BodyError:
        raise
    except Exception as error:  # whatever a body's own code raises
        raise BodyError(f"'{given}' cannot be opened: {type(error).__name__}: {error}", key=kind) from error
