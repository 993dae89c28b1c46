"""Damage to text files as it happens, and as somebody would do it on purpose.

A mutation is drawn by a `random.Random`, so that a case is made again from its seed. It works on tokens,
numbers, lines and bytes of a valid file: what is damaged at random bytes alone never gets past a parser's
first line.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from random import Random

NUMBERS = (
    "nan", "inf", "-inf", "1e400", "1e-400", "-1", "0", "-0", "1e308", "1e13", "1000000000", "2147483648",
    "9223372036854775808", "9" * 5000, "0x10", "1_000", "1,5", "1e", ".", "-", "+-1", "\u0661", "1e99999999",
    "0.0000001", "1000000", "1e-6", "NaN(1)", "Infinity", "1.", "\u22121", "10000000000000000000000",
)  # fmt: skip
SYMBOLS = (
    "{", "}", "[", "]", "(", ")", '"', "'", "=", ",", ";", ":", "#", "//", "\\", "%", "*", "\t", "\x0b",
    "\x0c", "\x1c", "\x85", "\u2028", "\u00a0", "\ufeff", "\x1b[31m", "\u202e", "=cmd|' /C calc'!A0", "../..",
    "$(id)",
)  # fmt: skip
BYTES = (b"\0", b"\xff", b"\xfe\xff", b"\xc3", b"\xed\xa0\x80", b"\r", b"\n\r", b"\x1a", b"\xef\xbb\xbf")
_TOKEN = re.compile(r"[^\s,=]+")
_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w.])")


def mutated(text: str, rng: Random) -> bytes:
    """Damage a text one to four times and encode it, in one case of three damaged again as bytes."""
    for _ in range(rng.choice((1, 1, 1, 2, 3, 4))):
        text = rng.choice(_TEXT_MUTATIONS)(text, rng)
    data = text.encode(rng.choice(_ENCODINGS), errors="replace")
    if rng.random() < 1 / 3:
        data = rng.choice(_BYTE_MUTATIONS)(data, rng)
    return data


def damaged(data: bytes, rng: Random) -> bytes:
    """Damage bytes one to three times."""
    for _ in range(rng.randint(1, 3)):
        data = rng.choice(_BYTE_MUTATIONS)(data, rng)
    return data


def _number(text: str, rng: Random) -> str:
    return _replaced(text, list(_NUMBER.finditer(text)), rng.choice(NUMBERS), rng)


def _token(text: str, rng: Random) -> str:
    found = list(_TOKEN.finditer(text))
    if not found:
        return text
    others = (
        rng.choice(found)[0],
        rng.choice(SYMBOLS),
        rng.choice(NUMBERS),
        "",
        rng.choice(found)[0].swapcase(),
    )
    return _replaced(text, found, rng.choice(others), rng)


def _replaced(text: str, found: list[re.Match[str]], new: str, rng: Random) -> str:
    if not found:
        return text
    place = rng.choice(found)
    return text[: place.start()] + new + text[place.end() :]


def _insertion(text: str, rng: Random) -> str:
    at = rng.randint(0, len(text))
    return text[:at] + rng.choice((*SYMBOLS, *NUMBERS, " ", "\n")) + text[at:]


def _lines(text: str, rng: Random) -> str:
    """Leave out, double, swap or move a run of lines."""
    lines = text.split("\n")
    start = rng.randrange(len(lines))
    run = lines[start : start + rng.choice((1, 1, 1, 2, 3, 8))]
    rest = lines[:start] + lines[start + len(run) :]
    at = rng.randint(0, len(rest))
    how = rng.randrange(4)
    if how == 0:
        return "\n".join(rest)
    if how == 1:
        return "\n".join(rest[:at] + run + rest[at:])
    if how == 2:
        return "\n".join(lines[:at] + run + lines[at:])
    return "\n".join(lines[:start] + run[::-1] + lines[start + len(run) :])


def _section_again(text: str, rng: Random) -> str:
    half = len(text) // 2
    part = text[rng.randint(0, half) : rng.randint(half, len(text))]
    return rng.choice((text + part, part + text, text + "\n" + text))


def _long_line(text: str, rng: Random) -> str:
    at = rng.randint(0, len(text))
    return (
        text[:at]
        + rng.choice(("x", "1 ", "{", " ", "9", "#", '"', "[")) * rng.choice((300, 5000))
        + text[at:]
    )


def _line_endings(text: str, rng: Random) -> str:
    return text.replace("\n", rng.choice(("\r", "\r\n", "\n\n", "\n\r", " ", "\x0b", "\x85", "\u2028")))


def _cut(text: str, rng: Random) -> str:
    return text[: rng.randint(0, len(text))]


def _empty(text: str, rng: Random) -> str:
    return rng.choice(("", "\n", " \t", "\ufeff", "#", text[:1], text[-1:]))


def _flip(data: bytes, rng: Random) -> bytes:
    if not data:
        return data
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 8))):
        changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _put(data: bytes, rng: Random) -> bytes:
    at = rng.randint(0, len(data))
    return data[:at] + rng.choice((*BYTES, rng.randbytes(rng.randint(1, 8)))) + data[at:]


def _overwrite(data: bytes, rng: Random) -> bytes:
    at = rng.randint(0, len(data))
    new = rng.choice((b"\0", b"\xff", rng.randbytes(1))) * rng.choice((1, 4, 64))
    return data[:at] + new + data[at + len(new) :]


def _cut_bytes(data: bytes, rng: Random) -> bytes:
    start = rng.randint(0, len(data))
    return rng.choice((data[:start], data[start:], data[:start] + data[start + 16 :]))


_TEXT_MUTATIONS: tuple[Callable[[str, Random], str], ...] = (
    _number, _number, _number, _token, _token, _token, _insertion, _insertion, _lines, _lines, _lines,
    _section_again, _long_line, _line_endings, _cut, _empty,
)  # fmt: skip
_BYTE_MUTATIONS: tuple[Callable[[bytes, Random], bytes], ...] = (_flip, _flip, _put, _overwrite, _cut_bytes)
_ENCODINGS = ("utf-8",) * 12 + ("latin-1", "utf-8-sig", "utf-16", "cp1252")
