"""Errors that a user can do something about; each is one line."""

from __future__ import annotations


class InputError(Exception):
    """Bad input. With a place it reads ``file:line:column: what is wrong``."""

    def __init__(self, message: str, place: tuple[str, int, int] | None = None) -> None:
        super().__init__(f"{place[0]}:{place[1]}:{place[2]}: {message}" if place else message)
        self.message = message
        self.place = place


class NotRunError(Exception):
    """Something was asked for that could not run here."""


def why(error: OSError) -> str:
    """The system's reason, as the end of a line: ``permission denied``."""
    return (error.strerror or str(error)).lower()
