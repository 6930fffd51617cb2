"""Lines of words and numbers, as formats of text have them."""

from __future__ import annotations

from collections.abc import Iterable


def line(*words: object) -> str:
    """Words and numbers with spaces between them; floats keep their full precision."""
    return " ".join(map(str, words))  # str of a float is its shortest exact form


def text(lines: Iterable[str]) -> bytes:
    """Lines as the content of a file."""
    return ("\n".join(lines) + "\n").encode()


def words_by_line(data: bytes) -> list[list[str]]:
    """The words of every line that has some, comments left out."""
    lines = (line.partition("#")[0].split() for line in data.decode("utf-8", "replace").splitlines())
    return [words for words in lines if words]
