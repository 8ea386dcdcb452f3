"""What the package raises about the files of a run."""

from __future__ import annotations


class MissingData(LookupError):
    """A frame or an array that the run has not written; the message says which key of the scene writes it."""


class NotThere(KeyError):
    """What a directory of the file should have and has not: at this moment, or for good."""


class NotARun(ValueError):
    """A directory that no run of Talus was begun in."""


class DamagedFile(ValueError):
    """A file of a run that does not hold what the program writes into it; the message names it."""
