"""The front door: names the commands, runs one, and turns errors into messages and exit statuses.

Commands are imported when they run, so that `drkid --help` answers at once.
"""

import sys

from cyclopts import App

from drkid import __version__
from drkid.errors import DrkidError

USAGE = 2  # exit status: arguments that cannot be used
INTERRUPTED = 130  # exit status after Ctrl-C, as shells have it

app = App(
    name="drkid",
    version=__version__,
    help="Turn an organic 3D shape into a construction kit whose pieces come in very few identical shapes.",
    help_format="plaintext",
    suppress_keyboard_interrupt=False,
)
app.command("drkid.commands:make", name="make", help="Make a kit from a segmented volume or a mesh.", sort_key=1)
app.command(
    "drkid.commands:inspect_source", name="inspect", help="Tell what a file holds and what make would take.", sort_key=2
)
app.command("drkid.commands:check", name="check", help="Recompute the numbers of a kit from its files.", sort_key=3)
app.command(
    "drkid.commands:schema", name="schema", help="Print the JSON Schema of kit.json or of the parameters.", sort_key=4
)


app.command("drkid.commands:render", name="render", help="Draw a kit as a PNG picture, without a GPU.", sort_key=5)


def main() -> None:
    """Entry point of the `drkid` program."""
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run a command line; its exit status."""
    try:
        return int(app(arguments, result_action="return_value") or 0)
    except DrkidError as error:
        from drkid.terminal import tell_error  # noqa: PLC0415 — only where there is something to tell

        tell_error(error)
        return error.exit_status
    except KeyboardInterrupt:
        from drkid.terminal import tell_interrupted  # noqa: PLC0415

        tell_interrupted()
        return INTERRUPTED
    except BrokenPipeError:  # the reader of our output has had enough, as `head` has
        sys.stdout = None
        return 0
    except SystemExit as status:  # the arguments could not be used, and cyclopts has said why
        return USAGE if status.code else 0
