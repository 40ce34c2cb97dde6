"""Cut: names shortened so that they can still be told apart.

In: the names that stand together in a picture. Out: as much of each as there is room for.
"""

from __future__ import annotations

from collections.abc import Iterable

from neurovis_spec.scene import texts


class Cut:
    """Shortens names so that they can be told apart: of those that share what would be left of them, the beginning
    goes."""

    def __init__(self, names: Iterable[str]) -> None:
        self._begins: dict[str, int] = {}
        for name in set(names):
            for end in range(1, len(name)):
                self._begins[name[:end]] = self._begins.get(name[:end], 0) + 1

    def shorten(self, name: str, size: float, room: float, weight: int = 600) -> str:
        """The name, or as much of it as fits into ``room`` with an ellipsis; '' where nothing does.

        >>> cut = Cut(["descending_1", "descending_2", "photoreceptor"])
        >>> cut.shorten("descending_2", 10, 60), cut.shorten("photoreceptor", 10, 60)
        ('…nding_2', 'photore…')
        """
        text = texts.shorten(name, size, room, weight)
        if text in (name, "") or self._begins.get(text[:-1], 0) < 2:
            return text
        return texts.shorten(name[::-1], size, room, weight)[::-1]

    def parts(self, base: str, subscript: str, size: float, room: float, weight: int = 600) -> tuple[str, str]:
        """A name with its subscript; without one where it is shortened."""
        if texts.width(base, size, weight, subscript) <= room:
            return base, subscript
        return self.shorten(base + subscript, size, room, weight), ""
