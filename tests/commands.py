"""The command line, called as the installed command is, in this process."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from yarnverify.cli import main

Run = tuple[int, str, str]


def status_of(monkeypatch: pytest.MonkeyPatch, *words: str) -> int:
    """The exit status of ``yarnverify`` with these words."""
    monkeypatch.setattr("sys.argv", ["yarnverify", *words])
    try:
        main()
    except SystemExit as stop:
        return int(stop.code or 0)
    return 0


def caller(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Callable[..., Run]:
    """What runs the command with words: exit status, standard output, standard error."""
    return lambda *words: (status_of(monkeypatch, *words), *capsys.readouterr())
