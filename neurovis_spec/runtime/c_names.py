"""Names of authors as identifiers, strings and comments of C and C++.

In: any text. Out: an identifier that no compiler, header or other name stands against; a literal; a comment's words.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable

#: Longer identifiers are cut, and end in a hash.
_LONGEST = 60
#: Longer literals are more than a compiler of C99 must take.
LONGEST_STRING = 4000


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_KEYWORDS = _words(
    """alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t char16_t char32_t class compl
    concept const consteval constexpr constinit const_cast continue co_await co_return co_yield decltype default delete
    do double dynamic_cast else enum explicit export extern false float for friend goto if inline int long mutable
    namespace new noexcept not not_eq nullptr operator or or_eq private protected public register reinterpret_cast
    requires restrict return short signed sizeof static static_assert static_cast struct switch template this
    thread_local throw true try typedef typeid typename typeof typeof_unqual union unsigned using virtual void volatile
    wchar_t while xor xor_eq"""
)
#: Macros of the headers used, and of compilers, that are no calls.
_MACROS = _words(
    "NULL NAN INFINITY HUGE_VAL HUGE_VALF HUGE_VALL MAXFLOAT DOMAIN SING OVERFLOW UNDERFLOW TLOSS PLOSS X_TLOSS EOF "
    "errno linux unix i386 stdin stdout stderr math_errhandling BUFSIZ"
)
_MACRO = re.compile(
    r"(?:FP|MATH|M|INTPTR|UINTPTR|SIZE|PTRDIFF|WCHAR|WINT|SIG_ATOMIC|INTMAX|UINTMAX)_[A-Z0-9_]+"
    r"|U?INT(?:_LEAST|_FAST)?[0-9]+_(?:MAX|MIN|C)|SEEK_[A-Z]+|L_tmpnam|[A-Z]+_MAX"
)
#: What files, targets of CMake and libraries may not be called: headers that others mean, and what is there already.
_FILES = _words(
    """alloca alltypes assert complex cpio ctype dirent dlfcn elf endian environ errno error fcntl features fenv float
    fmtmsg fnmatch ftw getopt glob grp iconv inttypes iso646 langinfo libgen limits link locale main malloc math memory
    monetary mqueue netdb poll pthread pwd random regex resolv sched search semaphore setjmp signal spawn stdalign
    stdarg stdatomic stdbool stddef stdint stdio stdlib stdnoreturn string strings syslog tar termios tgmath threads
    time uchar ucontext ulimit unistd utime values wait wchar wctype wordexp
    all clean depend edit_cache help install list_install_components package package_source preinstall rebuild_cache
    test c dl gcc m rt util"""
)
#: What functions of ours and of the system begin with, which end as ours do (``sem_init``), so that no network is
#: called so.
_TAKEN = re.compile(r"nv|sem|res|mtx|cnd|atomic|pthread(_\w*)?|posix(_\w*)?")


def identifier(name: str) -> str:
    """An identifier that is like a name.

    >>> identifier("left1.K"), identifier("double"), identifier("2nd"), identifier("größe")
    ('left1_K', 'double_', 'n2nd', 'gr_e')
    """
    made = re.sub(r"__+", "_", re.sub(r"[^A-Za-z0-9_]+", "_", name)).strip("_") or "unnamed"
    if made[0].isdigit():
        made = f"n{made}"
    if len(made) > _LONGEST:
        made = f"{made[: _LONGEST - 9]}_{hashlib.sha256(name.encode()).hexdigest()[:8]}"
    reserved = made in _KEYWORDS or made in _MACROS or _MACRO.fullmatch(made) is not None
    return f"{made}_" if reserved else made


def identifiers(names: Iterable[str], taken: Iterable[str] = ()) -> list[str]:
    """One for each name, all different.

    >>> identifiers(["a.b", "a_b", "c"])
    ['a_b', 'a_b_2', 'c']
    """
    found, used = [], set(taken)
    for name in names:
        made = first = identifier(name)
        number = 2
        while made in used:
            made = f"{first.rstrip('_')}_{number}"
            number += 1
        used.add(made)
        found.append(made)
    return found


def prefix(name: str) -> str:
    """What the files and all that they define begin with.

    >>> prefix("CPG RBF"), prefix("math"), prefix("nv")
    ('cpg_rbf', 'math_net', 'nv_net')
    """
    made = identifier(name).lower().rstrip("_") or "unnamed"
    return f"{made}_net" if made in _FILES or _TAKEN.fullmatch(made) else made


def string(text: str) -> str:
    """A literal.

    >>> string('a"b?')
    '"a\\\\"b\\\\?"'
    """
    made = []
    for byte in text.encode():
        character = chr(byte)
        if character in '"\\?':
            made.append(f"\\{character}")
        elif 32 <= byte < 127:
            made.append(character)
        else:
            made.append(f"\\{byte:03o}")
    return f'"{"".join(made)}"'


def words(text: str, longest: int = 70) -> str:
    """What may stand in a comment.

    >>> words("a */ b")
    'a * / b'
    """
    plain = "".join(c if " " <= c <= "~" else "?" for c in text).replace("*/", "* /").replace("/*", "/ *")
    plain = plain.replace("\\", "/").replace("??", "?")
    return plain if len(plain) <= longest else f"{plain[: longest - 3]}..."
