"""What can go wrong, by name: every message says what was wrong, where, and what to do."""

import difflib
from collections.abc import Iterable

LONGEST_QUOTED = 300  # fitted: characters of another library's words


class GlskError(Exception):
    """Base of all errors this package raises on purpose. Of a long message its middle is left out."""

    def __str__(self) -> str:
        words = super().__str__()
        head, tail = 2 * LONGEST_QUOTED, LONGEST_QUOTED  # how it begins says where, and its end why
        return words if len(words) <= head + tail else f"{words[:head]} ... {words[-tail:]}"


class InvalidCloudError(GlskError, ValueError):
    """The input points cannot be skeletonised."""


class InvalidParameterError(GlskError, ValueError):
    """A filter parameter is unknown, of the wrong type, or out of range."""


class StageError(GlskError, TypeError):
    """A filter lacks the result of an earlier stage, returned the wrong type, or is a plugin and failed."""


class FileFormatError(GlskError, ValueError):
    """A file cannot be read or written in the format asked for."""


class ScriptError(GlskError, ValueError):
    """A filter script is malformed, names an unknown filter or parameter, or fails; the message names file and line."""


class RecipeError(GlskError, ValueError):
    """A recipe is malformed, or a pipeline cannot be written as one."""


class BatchError(GlskError, RuntimeError):
    """A batch cannot continue: its folder is in use, or no worker is available."""


class MissingPackageError(GlskError, ImportError):
    """An optional package, or a system library it needs, is not installed."""


class DisplayError(GlskError, RuntimeError):
    """There is no screen to open a window on."""


class SkeletonWarning(UserWarning):
    """The skeleton was computed but should not be trusted blindly."""


class PluginWarning(UserWarning):
    """A plugin of another distribution is broken and was left out."""


def brief(error: object) -> str:
    """The beginning of what another library's error says, or of a name in a file, in one line: some repeat the file."""
    words = " ".join(str(error).split())
    return words if len(words) <= LONGEST_QUOTED else f"{words[:LONGEST_QUOTED]}..."


def in_words(error: BaseException) -> str:
    """What an error says, in one line; of a file that cannot be had, its name and why."""
    if isinstance(error, OSError) and error.strerror and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split()) or type(error).__name__


def did_you_mean(word: str, known: Iterable[str], what: str) -> str:
    """The message for an unknown word: the known one that was meant, or all that there are.

    >>> did_you_mean("radios", ["radius", "links"], "parameter of Connector")
    "no parameter of Connector is called 'radios': did you mean 'radius'?"
    """
    names, word = {name.lower(): name for name in known}, brief(word)
    close = difflib.get_close_matches(word.lower(), names, n=1) or [name for name in names if name.startswith(word)]
    listed = f"there are {', '.join(names.values()) or 'none'}" if len(names) <= 40 else "and none is like it"
    hint = f"did you mean {names[close[0]]!r}?" if word and close else listed
    if what.startswith("attribute") and hint != listed and len(names) <= 40:  # files differ in what they have
        hint = f"{hint} ({listed})"
    return f"no {what} is called {word!r}: {hint}"
