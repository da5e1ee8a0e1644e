"""Vectorised reading and writing of text files of numbers."""

from __future__ import annotations

from typing import BinaryIO, NoReturn

import numpy as np

from gso.errors import MeshError
from gso.typing import Array, Flags, Ints

# Integers with more digits may overflow 64 bits, and are no valid vertex indices.
_DIGITS = 18
_BLOCK = 1 << 15


class Words:
    """The words of a text, separated by white space, and the rows that contain them.

    Parameters
    ----------
    data : bytes
        ASCII text; bytes of other encodings are part of words and never decoded.
    comment : bytes, optional
        Character that starts a comment, which extends to the end of the line.
    joined : bool
        Whether a backslash at the end of a line continues it on the next one.
    first_line : int
        Number of the first line, for error messages.

    Attributes
    ----------
    start, stop : ndarray of int
        Byte offsets of the start and end of each word.
    first, count : ndarray of int
        First word and number of words of each row that is not empty.
    """

    def __init__(
        self, data: bytes, *, comment: bytes = b"", joined: bool = False, first_line: int = 1
    ):
        if b"\0" in data:
            raise MeshError("this is no text: it has zero bytes; does the suffix fit the file?")
        if b"\n" not in data:
            data = data.replace(b"\r", b"\n")
        data = data.removeprefix(b"\xef\xbb\xbf")
        self._data = data
        self._first_line = first_line
        text = np.frombuffer(data, np.uint8)
        breaks = np.flatnonzero(text == ord("\n"))
        if comment and comment in data:
            text = _blank_comments(text, breaks, ord(comment))
        if joined and b"\\" in data:
            text, breaks = _join_lines(text, breaks)
        self._text = text
        space = np.concatenate([[True], text <= ord(" "), [True]])
        self.start: Ints = np.flatnonzero(space[:-1] & ~space[1:])
        self.stop: Ints = np.flatnonzero(~space[:-1] & space[1:])
        line = np.searchsorted(breaks, self.start)
        new = np.ones(line.size, bool)
        new[1:] = line[1:] != line[:-1]
        self.first: Ints = np.flatnonzero(new)
        self.count: Ints = np.diff(self.first, append=line.size)

    def row(self, words: Ints) -> Ints:
        """Return the rows that contain the given words."""
        return np.searchsorted(self.first, words, side="right") - 1

    def rows(self, keyword: bytes) -> Ints:
        """Return the rows whose first word is `keyword`."""
        start, stop = self.start[self.first], self.stop[self.first]
        found = np.flatnonzero(stop - start == len(keyword))
        for k, letter in enumerate(keyword):
            found = found[self._text[start[found] + k] == letter]
        return found

    def floats(self, words: Ints) -> Array:
        """Parse finite numbers in the given words, which must be ascending."""
        edge = np.zeros(self._text.size + 1, np.int8)
        edge[self.start[words]] = 1
        edge[self.stop[words]] -= 1
        inside = np.cumsum(edge[:-1], dtype=np.int8) > 0
        text = np.where(inside, self._text, np.uint8(ord(" "))).tobytes()
        tokens = text.split()
        # Python's float accepts 1_000; no file format does.
        values = None if b"_" in text else _as_floats(tokens)
        if values is None or not np.isfinite(values).all():
            bad = next(k for k, t in enumerate(tokens) if not _is_finite(t))
            self.fail(words[bad], f"{self.quote(words[bad])} is not a finite number")
        return values

    def points(self, words: Ints) -> Array:
        """Parse three finite numbers from each of the given words on, which ascend, (n, 3)."""
        return self.floats((words[:, None] + np.arange(3)).ravel()).reshape(-1, 3)

    def ints(self, words: Ints, *, until: bytes = b"") -> Ints:
        """Parse integers in the given words, each up to the character `until`."""
        start, stop = self.start[words], self.stop[words]
        if until:
            stop = self._next(start, stop, until)
        return self._whole(words, start, stop)

    def second_ints(self, words: Ints, between: bytes) -> Ints:
        """Parse integers between the first and second character `between`; 0 where missing."""
        stop = self.stop[words]
        start = np.minimum(self._next(self.start[words], stop, between) + 1, stop)
        stop = self._next(start, stop, between)
        there = stop > start
        values = np.zeros(words.size, np.int64)
        values[there] = self._whole(words[there], start[there], stop[there])
        return values

    def _next(self, start: Ints, stop: Ints, mark: bytes) -> Ints:
        """Find the first position of a character from `start` on, or `stop` if there is none."""
        marks = np.flatnonzero(self._text == ord(mark))
        if not marks.size:
            return stop
        at = np.searchsorted(marks, start)
        cut = marks[np.minimum(at, marks.size - 1)]
        return np.where((cut >= start) & (cut < stop), cut, stop)

    def _whole(self, words: Ints, start: Ints, stop: Ints) -> Ints:
        """Parse integers in parts of words; the first invalid one raises a MeshError."""
        values, bad = self._parsed(start, stop)
        if bad.any():
            word = words[bad.argmax()]
            self.fail(word, f"{self.quote(word)} is not a whole number of usual size")
        return values

    def ints_or(self, words: Ints, otherwise: int) -> Ints:
        """Parse integers in the given words, with `otherwise` for words that are no integers."""
        values, bad = self._parsed(self.start[words], self.stop[words])
        return np.where(bad, otherwise, values)

    def _parsed(self, start: Ints, stop: Ints) -> tuple[Ints, Flags]:
        """Parse integers in parts of the text; also return which parts are invalid."""
        sign = self._text[np.minimum(start, self._text.size - 1)]
        start = start + ((sign == ord("-")) | (sign == ord("+")))
        size = stop - start
        bad = (size < 1) | (size > _DIGITS)
        values = np.zeros(start.size, np.int64)
        for k in range(min(int(size.max(initial=0)), _DIGITS)):
            inside = k < size
            at = np.maximum(np.minimum(start + k, stop - 1), 0)
            digit = self._text[at].astype(np.int64) - ord("0")
            bad |= inside & ((digit < 0) | (digit > 9))
            values = np.where(inside, 10 * values + digit, values)
        return np.where(sign == ord("-"), -values, values), bad

    def raw(self, word: int | np.integer) -> bytes:
        """Return the bytes of a word."""
        return self._data[self.start[word] : self.stop[word]]

    def rest(self, row: int | np.integer) -> str:
        """Return the text after a row's first word, up to a comment or the end of the line."""
        if self.count[row] < 2:
            return ""
        begin = self.start[self.first[row] + 1]
        end = self._data.find(b"\n", begin)
        text = self._data[begin : len(self._data) if end < 0 else end].replace(b"\t", b" ")
        # A '#' inside a word is part of a name. A trailing backslash would join lines.
        text = text.split(b" #")[0].strip().rstrip(b"\\").rstrip()
        return text.decode("utf-8", "surrogateescape")

    def quote(self, word: int | np.integer) -> str:
        """Return a word as shown in error messages."""
        text = self.raw(word)
        return repr(text[:24].decode("ascii", "backslashreplace")) + ("..." if text[24:] else "")

    def fail(self, word: int | np.integer, message: str) -> NoReturn:
        """Raise a MeshError that names the line of a word."""
        line = self._first_line + self._data.count(b"\n", 0, int(self.start[word]))
        raise MeshError(f"line {line}: {message}")

    def refuse(self, rows: Ints, bad: Flags, message: str) -> None:
        """Raise a MeshError that names the line of the first bad row, if there is one."""
        if bad.any():
            self.fail(self.first[rows[bad.argmax()]], message)


def write_rows(file: BinaryIO, formats: str | list[str], values: Array | Ints) -> None:
    """Write rows of numbers with one printf format for all rows, or with one per row.

    With one format per row, negative numbers are padding and are left out.
    """
    for k in range(0, len(values), _BLOCK):
        block = values[k : k + _BLOCK]
        if isinstance(formats, str):
            text = (formats * len(block)) % tuple(block.ravel().tolist())
        else:
            text = "".join(formats[k : k + _BLOCK]) % tuple(block[block >= 0].tolist())
        file.write(text.encode("ascii"))


def _blank_comments(text: np.ndarray, breaks: Ints, mark: int) -> np.ndarray:
    begin = np.flatnonzero(text == mark)
    end = np.append(breaks, text.size)[np.searchsorted(breaks, begin)]
    first = np.ones(begin.size, bool)
    first[1:] = end[1:] != end[:-1]
    edge = np.zeros(text.size + 1, np.int8)
    edge[begin[first]] = 1
    edge[end[first]] -= 1
    return np.where(np.cumsum(edge[:-1], dtype=np.int8) > 0, np.uint8(ord(" ")), text)


def _join_lines(text: np.ndarray, breaks: Ints) -> tuple[np.ndarray, Ints]:
    padded = np.concatenate([np.zeros(2, np.uint8), text])
    last = np.where(padded[breaks + 1] == ord("\r"), breaks - 2, breaks - 1)
    joins = padded[last + 2] == ord("\\")
    text = text.copy()
    text[last[joins]] = ord(" ")
    return text, breaks[~joins]


def _as_floats(tokens: list[bytes]) -> Array | None:
    try:
        return np.fromiter(map(float, tokens), np.float64, len(tokens))
    except ValueError:
        return None


def _is_finite(token: bytes) -> bool:
    values = None if b"_" in token else _as_floats([token])
    return values is not None and bool(np.isfinite(values).all())
