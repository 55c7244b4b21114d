"""The command line, `beacon-mj`.

Exit status: 0 done, 1 a check failed, 2 bad input, 130 interrupted, 143 terminated.
"""

import sys
from collections.abc import Sequence

FAILED, BAD_INPUT, INTERRUPTED = 1, 2, 130


def main(arguments: Sequence[str] | None = None) -> None:
    """Run a command and exit with its status."""
    from beacon_mj.cli.standard_streams import open_missing

    open_missing()
    sys.exit(run(sys.argv[1:] if arguments is None else arguments))


def run(arguments: Sequence[str]) -> int:
    """Run a command and return its status; bad input is one line on stderr.

    Args:
        arguments: The words after `beacon-mj`.
    """
    from cyclopts import CycloptsError, UnknownCommandError
    from rich.console import Console

    from beacon_mj.cli.app import COMMANDS, LOG_COMMANDS, app
    from beacon_mj.cli.interrupts import status_of, terminable
    from beacon_mj.cli.renamed import check_names
    from beacon_mj.cli.standard_streams import results_on_stdout
    from beacon_mj.errors import BeaconError, unknown

    try:
        check_names(arguments)
        with terminable(), results_on_stdout() as results:
            status = app(
                list(arguments),
                console=Console(file=results),
                exit_on_error=False,
                print_error=False,
                result_action="return_value",
            )
    except UnknownCommandError as error:
        # Its own text would import every command to list them.
        known = (
            LOG_COMMANDS if "log" in (error.command_chain or ()) else [*COMMANDS, "log"]
        )
        return _refuse(unknown("command", (error.unused_tokens or [""])[0], known))
    except (BeaconError, CycloptsError) as error:
        return _refuse(str(error))
    except BrokenPipeError:
        return 0  # The reader of a pipe, such as `head`, has had enough.
    except OSError as error:
        return _refuse(f"{error.filename or 'file system'}: {error.strerror or error}.")
    except UnicodeError as error:
        return _refuse(f"expected text that UTF-8 can hold: {error}.")
    except KeyboardInterrupt as stop:
        _remark(*(getattr(stop, "__notes__", ()) or ["interrupted"]))
        return status_of(stop)
    return status if isinstance(status, int) else 0


def _refuse(message: str) -> int:
    _remark(f"error: {' '.join(message.split())}")
    return BAD_INPUT


def _remark(*lines: str) -> None:
    from beacon_mj.cli.views.console import remark  # Not paid for by `--help`.

    remark(*lines)
