"""Cut: names shortened to a width, so that they can still be told apart.

In: all names that stand together in a picture, those with numbers without them. Out: for one of them and a width, the
beginning of the name and an ellipsis; the end of the name instead, if others begin in the same way.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable

from neurovis_spec.scene import texts


class Cut:
    """Shortens names: to their beginning if that tells a name from the others, else to their end."""

    def __init__(self, names: Iterable[str]) -> None:
        self._names = sorted(set(names))

    def _is_shared(self, begin: str) -> bool:
        """Whether two names or more go on behind this beginning: in order they stand together, right behind it."""
        second = bisect_right(self._names, begin) + 1
        return begin != "" and second < len(self._names) and self._names[second].startswith(begin)

    def shorten(self, name: str, size: float, room: float, weight: int = 600) -> str:
        """The name, or what of its beginning (or end) fits into ``room`` with an ellipsis; '' where nothing does.

        >>> cut = Cut(["descending_1", "descending_2", "photoreceptor"])
        >>> cut.shorten("descending_2", 10, 60), cut.shorten("photoreceptor", 10, 60)
        ('…nding_2', 'photore…')
        """
        text = texts.shorten(name, size, room, weight)
        if text in (name, "") or not self._is_shared(text[:-1]):
            return text
        return texts.shorten(name[::-1], size, room, weight)[::-1]

    def parts(self, base: str, subscript: str, size: float, room: float, weight: int = 600) -> tuple[str, str]:
        """A name and its number, which stays whole.

        >>> Cut(["descending", "interneuron"]).parts("interneuron", "12", 10, 60)
        ('intern…', '12')
        """
        return self.shorten(base, size, room - texts.width("", size, weight, subscript), weight), subscript
