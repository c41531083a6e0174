# SPDX-FileCopyrightText: 2026 The vigg_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The command ``vigg``: parses arguments and hands over to the command, which is imported only then."""

from __future__ import annotations

import argparse
import importlib
import sys
import warnings
from collections.abc import Sequence

import vigg_ros

COMMANDS = {
    "replay": ("cli.replay", "register all frames of a recorded bag and report the trajectory"),
    "register": ("cli.register", "register two pairs of a colour and a depth image"),
    "convert": ("bench.commands.convert_command", "turn a data set folder into a bag"),
    "play": ("cli.play", "publish a bag's messages over ROS 2"),
    "live": ("cli.live", "run the node on a bag over ROS 2, and watch it"),
    "evaluate": (
        "bench.commands.evaluate", "measure accuracy on pairs of frames and on trajectories whose truth is known"
    ),
    "doctor": ("cli.doctor", "say what a bag holds and what is missing for a replay"),
    "benchmark": ("bench.commands.benchmark", "measure the time of each stage and of message conversion"),
    "config": ("cli.show_config", "print a configuration, with every option explained"),
}
"""Each with its module, which has ``add_arguments(parser)`` and ``run(arguments)``, and what it does."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit code (see ``cli.console.ExitCode``)."""
    argv = list(sys.argv[1:] if argv is None else argv)
    name = next((word for word in argv if word in COMMANDS), None)
    arguments = _parser(name).parse_args(argv)
    from vigg_ros.cli import console
    from vigg_ros.registration.errors import BagError, ViggError

    try:
        with warnings.catch_warnings():
            warnings.showwarning = _note  # type: ignore[assignment]
            return int(arguments.run(arguments))
    except ViggError as error:
        print(f"vigg {arguments.command}: {error}", file=sys.stderr)
        # What is no unreadable bag the user can ask for differently.
        return int(console.ExitCode.UNREADABLE if type(error) is BagError else console.ExitCode.USAGE)
    except KeyboardInterrupt:
        print(f"vigg {arguments.command}: interrupted", file=sys.stderr)
        return int(console.ExitCode.INTERRUPTED)
    except BrokenPipeError:
        # The reader of our output has gone (`vigg ... | head`): nothing is left to say, and nobody to say it to.
        sys.stderr.close()
        return int(console.ExitCode.OK)


def _note(message: Warning | str, *_: object) -> None:
    """A warning of this package or another one, as a line for people."""
    print(f"note: {message}", file=sys.stderr)


def _parser(wanted: str | None) -> argparse.ArgumentParser:
    """All commands by name; only the wanted one is imported and knows its arguments."""
    parser = argparse.ArgumentParser(prog="vigg", description="Registration of camera frames with depth (ViGG).")
    parser.add_argument("--version", action="version", version=f"vigg {vigg_ros.__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, (place, text) in COMMANDS.items():
        command = commands.add_parser(name, help=text, description=f"{text[0].upper()}{text[1:]}.")
        if name == wanted:
            module = importlib.import_module(f"vigg_ros.{place}")
            module.add_arguments(command)
            command.set_defaults(run=module.run)
    return parser


if __name__ == "__main__":
    sys.exit(main())
