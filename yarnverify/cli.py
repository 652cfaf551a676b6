"""The command line: ``yarnverify --help``.

Exit status: 0 all as expected; 1 a check failed, or an erratum is new or stale; 2 bad usage or input; 3 asked for but
could not run.
"""

from __future__ import annotations

import io
import sys

import cyclopts
from cyclopts import App

from yarnverify import __version__
from yarnverify.commands.implementations import check, export
from yarnverify.commands.measurements import accuracy, benchmark, fuzz
from yarnverify.commands.proofs import derive, generate, init, prove, report, tutorial
from yarnverify.commands.shared import stop
from yarnverify.commands.simulations import analyse, simulate

app = App(
    name="yarnverify",
    version=__version__,
    help="Proofs for printed yarn energies, forces and Jacobians, and NumPy kernels derived from them.",
)
for command in (
    init, prove, derive, generate, check, export, accuracy, benchmark, fuzz, simulate, analyse, report, tutorial,
):  # fmt: skip
    app.command(command)


def main() -> None:
    """Run the command line; bad input is one line on standard error and exit status 2."""
    from yarnverify.errors import InputError, NotRunError

    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # a terminal without Greek letters still gets the result
    try:
        app(sys.argv[1:], error_formatter=lambda error: f"yarnverify: {error}", exit_on_error=False, print_error=False)
    except cyclopts.UnusedCliTokensError as error:
        stop(f"yarnverify: {_unused(error.unused_tokens or [''], sys.argv[1:])}")
    except cyclopts.CycloptsError as error:
        stop(f"yarnverify: {' '.join(str(error).split())}")
    except InputError as error:
        stop(str(error))
    except NotRunError as error:
        stop(str(error), 3)
    except MemoryError as error:
        stop(f"yarnverify: this needs more memory than there is: {error or 'none is left'}", 3)
    except ImportError as error:
        if not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        sys.exit(130)  # a library that was being loaded takes an interruption for a failure of its own
    except BrokenPipeError:
        sys.stderr.close()
        sys.exit(0)


def _unused(words: list[str], given: list[str]) -> str:
    """What to do about words that no option took."""
    before = given[: given.index(words[0])] if words[0] in given else []
    option = next((word for word in reversed(before) if word.startswith("--")), "")
    if option and all("=" in word for word in words):
        return f"write {option} before each: {' '.join(f'{option} {word}' for word in words)}"
    return f"nothing takes {' '.join(words)}: an option takes the one value right behind it"
