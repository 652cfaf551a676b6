"""``python -m yarnverify`` is the ``yarnverify`` command."""

from yarnverify.cli import main

main()
