# SPDX-FileCopyrightText: 2026 tf_tree_py maintainers
# SPDX-License-Identifier: Apache-2.0

"""
The tools as verbs of the ros2 command: ``ros2 tf echo``, ``ros2 tf doctor``, and so on.

ros2cli finds them by entry points, like those of ros2topic. Only ros2cli imports this.
"""

from argparse import ArgumentParser, Namespace, REMAINDER
from importlib import import_module
from typing import Any

from ros2cli.command import add_subparsers_on_demand, CommandExtension
from ros2cli.plugin_system import PLUGIN_SYSTEM_VERSION, satisfies_version

VERBS = 'tf_tree_py.verb'
"""The group of entry points; other packages may add verbs to it."""


class TfCommand(CommandExtension):  # type: ignore[misc]
    """Inspect the transform tree."""

    def add_arguments(self, parser: ArgumentParser, cli_name: str) -> None:
        """Add a parser for each verb."""
        self._parser = parser
        add_subparsers_on_demand(parser, cli_name, '_verb', VERBS, required=False)

    def main(self, *, parser: ArgumentParser, args: Namespace) -> int:
        """Run the given verb; without one, print the help."""
        verb: Any = getattr(args, '_verb', None)
        if verb is None:
            self._parser.print_help()
            return 0
        status: int = verb.main(args=args)
        return status


class VerbExtension:
    """
    The extension point for verbs of ``ros2 tf``: the verb ``echo`` runs the tool ``tf_echo``.

    :ivar NAME: the entry point's name, which ros2cli sets.
    """

    NAME: str | None = None
    EXTENSION_POINT_VERSION = '0.1'

    def __init__(self) -> None:
        satisfies_version(PLUGIN_SYSTEM_VERSION, '^0.1')

    def add_arguments(self, parser: ArgumentParser, _: str) -> None:
        """Leave all arguments to the tool, also --help: it reads them as when it runs alone."""
        parser.prefix_chars = '\0'
        parser.add_argument('arguments', nargs=REMAINDER)

    def main(self, *, args: Namespace) -> int:
        """Run the tool."""
        tool = f'tf_{self.NAME}'
        status: int = import_module(f'.{tool}', __package__).main([tool, *args.arguments])
        return status


class ArchiveVerb(VerbExtension):
    """Report on thousands of recordings, or export from them."""


class AuditVerb(VerbExtension):
    """Run a program, and report which of its lines looked up which time."""


class CalibrateVerb(VerbExtension):
    """Judge whether a mounting or the stamps are wrong, and estimate the right values."""


class DoctorVerb(VerbExtension):
    """Report what is wrong with the tree, the worst first."""


class EchoVerb(VerbExtension):
    """Print the pose of one frame in another, and the path between them."""


class ExportVerb(VerbExtension):
    """Write the poses of one frame in another, from a recording."""


class FramesVerb(VerbExtension):
    """Show all frames, on the terminal or as a drawing."""


class MonitorVerb(VerbExtension):
    """Show every edge in a live table, those with trouble first."""


class RecordVerb(VerbExtension):
    """Keep the last seconds, and write them as a bag when something happens."""
