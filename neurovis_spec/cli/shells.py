"""Bash as this command line completes in it: words that Bash has broken at their ``=`` are put together again.

In: the words of the line as Bash counts them, ``--input``, ``touch``, ``=``, ``to``. Out: what to put in place of the
last of them. The other shells break no words, and are click's own.
"""

from __future__ import annotations

from collections.abc import Sequence

from click.shell_completion import BashComplete, CompletionItem, add_completion_class

_ADD = "COMPREPLY+=($value)"


class Bash(BashComplete):
    """Click's script and its answers, but for the sign ``=``."""

    _ahead = ""  # what Bash takes for words before the one to complete
    #: no blank behind ``name=``: a value follows
    source_template = BashComplete.source_template.replace(
        _ADD, f"{_ADD}\n            [[ $value == *= ]] && compopt -o nospace"
    )

    def get_completion_args(self) -> tuple[list[str], str]:
        """The words before the one to complete, and that one."""
        args, incomplete = super().get_completion_args()
        *words, last = joined([*args, incomplete])
        typed = "" if incomplete == "=" else incomplete
        self._ahead = "" if last == incomplete else last[: len(last) - len(typed)]
        return words, last

    def get_completions(self, args: list[str], incomplete: str) -> list[CompletionItem[str]]:
        """The completions, without what Bash takes for earlier words."""
        found = super().get_completions(args, incomplete)
        if self._ahead and found and all(item.value.startswith(self._ahead) for item in found):
            # behind the sign of a ``name=FILE`` are files, and Bash knows best how to write their names
            return [CompletionItem(incomplete.removeprefix(self._ahead), type="file")]
        return found


def joined(words: Sequence[str]) -> list[str]:
    """Words with those around an ``=`` in one.

    >>> joined(["run", "--input", "touch", "=", "to"]), joined(["run", "--input", "touch", "="])
    (['run', '--input', 'touch=to'], ['run', '--input', 'touch='])
    """
    result: list[str] = []
    open_sign = False
    for word in words:
        if result and (word == "=" or open_sign):
            result[-1] += word
        else:
            result.append(word)
        open_sign = word == "="
    return result


def register() -> None:
    """Let click use these instead of its own."""
    add_completion_class(Bash)
