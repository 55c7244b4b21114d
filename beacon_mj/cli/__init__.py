"""The command line, `beacon-mj`.

Exit status: 0 done, 1 a check failed, 2 bad input, 130 interrupted, 143 terminated.
"""

import os
import sys
from collections.abc import Sequence

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and exit with its status."""
    sys.exit(run(sys.argv[1:] if arguments is None else arguments))


def run(arguments: Sequence[str]) -> int:
    """Run a command and return its status; bad input is one line on stderr.

    Args:
        arguments: The words after `beacon-mj`.
    """
    from cyclopts import CycloptsError, UnknownCommandError

    from beacon_mj.cli.app import COMMANDS, LOG_COMMANDS, app
    from beacon_mj.cli.interrupts import status_of, terminable
    from beacon_mj.cli.renamed import check_names
    from beacon_mj.errors import BeaconError, unknown

    try:
        check_names(arguments)
        with terminable():
            status = app(
                list(arguments),
                exit_on_error=False,
                print_error=False,
                result_action="return_value",
            )
        sys.stdout.flush()
    except UnknownCommandError as error:
        # Its own text would import every command to list them.
        known = (
            LOG_COMMANDS if "log" in (error.command_chain or ()) else [*COMMANDS, "log"]
        )
        return _refuse(unknown("command", (error.unused_tokens or [""])[0], known))
    except (BeaconError, CycloptsError) as error:
        return _refuse(str(error))
    except BrokenPipeError:
        # The reader of a pipe, such as `head`, has had enough.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        return _refuse(f"{error.filename or 'file system'}: {error.strerror or error}.")
    except KeyboardInterrupt as stop:
        for line in getattr(stop, "__notes__", ()) or ["interrupted"]:
            print(line, file=sys.stderr)
        return status_of(stop)
    return status if isinstance(status, int) else 0


def _refuse(message: str) -> int:
    print(f"error: {' '.join(message.split())}", file=sys.stderr)
    return BAD_INPUT
