"""The benchmark record on a terminal: tables, or plain text in a pipe."""

from __future__ import annotations

import shutil
import sys
from typing import Any

from yarnverify.report.benchmark import tables, where
from yarnverify.report.simulation_speed import speed_tables
from yarnverify.report.table import Table


def show_benchmark(record: dict[str, Any]) -> None:
    """Print all tables of a record, and where it was measured."""
    chosen = speed_tables(record) if "cloth" in record else [t for e in record["energies"] for t in tables(record, e)]
    for table in chosen:
        if sys.stdout.isatty():
            _rich(table)
        else:
            print("\n".join(plain(table)))
        for note in table.notes:
            print(note)
        print()
    print(f"Measured in {record['clock']} on {where(record)}; shown, and compared with nothing.")
    print(f"Command: {record['command']}")


def plain(table: Table) -> list[str]:
    """A table as lines of text, columns aligned; the first to the left, the others to the right."""
    lines = [table.headings, *table.rows]
    widths = [max(len(line[i]) for line in lines) for i in range(len(table.headings))]
    rest = list(enumerate(widths))[1:]
    texts = ["  ".join([line[0].ljust(widths[0]), *(line[i].rjust(width) for i, width in rest)]) for line in lines]
    return [table.title, *(text.rstrip() for text in texts)]


def _rich(table: Table) -> None:
    from rich import box
    from rich.console import Console
    from rich.table import Table as Drawn

    drawn = Drawn(title=table.title, title_justify="left", box=box.SIMPLE_HEAD)
    for number, heading in enumerate(table.headings):
        drawn.add_column(heading, justify="right" if number else "left")
    for row in table.rows:
        drawn.add_row(*row)
    Console(width=shutil.get_terminal_size((120, 24)).columns).print(drawn)
