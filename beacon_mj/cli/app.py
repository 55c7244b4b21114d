"""The commands by name. Each is imported when it is used."""

from pathlib import Path
from typing import Any

from cyclopts import App, CycloptsError
from cyclopts.config import Toml

import beacon_mj
from beacon_mj.cli.renamed import check_name

COMMANDS = {
    "eval": (
        "beacon_mj.cli.evaluate:evaluate",
        "Run planners through scenes: logs, rows, tables.",
    ),
    "generate": (
        "beacon_mj.cli.scenes:generate",
        "Write scenes, as JSON and as MJCF.",
    ),
    "certify": (
        "beacon_mj.cli.certify:certify",
        "Prove in MuJoCo that scenes can be solved without damage.",
    ),
    "regret": (
        "beacon_mj.cli.regret:regret",
        "Compare a planner with one that knows everything.",
    ),
    "ablate": (
        "beacon_mj.cli.ablate:ablate",
        "Switch off a planner's parts one at a time.",
    ),
    "sweep": (
        "beacon_mj.cli.sweep:sweep",
        "Sweep a planner's parameters, by default the paper's Table I.",
    ),
    "merge": (
        "beacon_mj.cli.merge:merge",
        "Put the shards of a run together.",
    ),
    "compare": (
        "beacon_mj.cli.compare:compare",
        "Compare planners or runs, scene by scene.",
    ),
    "learning": (
        "beacon_mj.cli.learning:learning",
        "Compare what learning saved with what it saves the optimum.",
    ),
    "report": (
        "beacon_mj.cli.report:report",
        "Write a run as one self-contained page.",
    ),
    "view": ("beacon_mj.cli.scenes:view", "Look at a scene."),
    "families": ("beacon_mj.cli.scenes:families", "List the scene families."),
    "planners": ("beacon_mj.cli.planners:planners", "List the planners."),
    "check-planner": (
        "beacon_mj.cli.planners:check_planner",
        "Check that a planner keeps the contract.",
    ),
    "robots": ("beacon_mj.cli.robots:robots", "List the robots, or check your own."),
    "replay": (
        "beacon_mj.cli.replay:replay",
        "Look at an episode's log, or measure it.",
    ),
    "verify": (
        "beacon_mj.cli.verify:verify",
        "Check what a log, a run or a bundle claims, by making it again.",
    ),
    "bundle": (
        "beacon_mj.cli.bundle:bundle",
        "Write a finished run as one file that verify takes.",
    ),
    "leaderboard": (
        "beacon_mj.cli.leaderboard:leaderboard",
        "Write a static page of bundles that hold when they are verified.",
    ),
    "plot": (
        "beacon_mj.cli.plot:plot",
        "Draw an episode's log in one 2-D picture.",
    ),
    "export": (
        "beacon_mj.cli.export:export",
        "Write an episode's log as a ROS 2 bag.",
    ),
    "fidelity": (
        "beacon_mj.cli.machine:fidelity",
        "Compare the physics with closed forms.",
    ),
    "bench": (
        "beacon_mj.cli.bench:bench",
        "Measure what episodes cost on this machine.",
    ),
    "doctor": ("beacon_mj.cli.machine:doctor", "Say what this machine is missing."),
}
LOG_HELP = "Recover a log, describe it, or lay it out in a viewer."
LOG_COMMANDS = {
    "info": ("beacon_mj.cli.log:info", "Say what a log holds."),
    "layout": ("beacon_mj.cli.log:layout", "Write layouts for Foxglove, Lichtblick."),
    "recover": ("beacon_mj.cli.log:recover", "Make a whole file of an unfinished log."),
}


class OptionsFile(Toml):
    """Options from a TOML file; one that is broken is named."""

    def _load_config(self, path: Path) -> dict[str, Any]:
        try:
            found = super()._load_config(path)
        except ValueError as error:
            raise CycloptsError(msg=f"{path}: not valid TOML: {error}") from error
        for command, values in found.items():
            for option in values if isinstance(values, dict) else ():
                check_name(command, f"--{option}")
        return found


app = App(
    name="beacon-mj",
    help="Push or go round: planners that learn by touch, in MuJoCo.",
    help_format="plaintext",
    version=beacon_mj.__version__,
    config=OptionsFile("beacon.toml"),
    suppress_keyboard_interrupt=False,
)
for _name, (_path, _help) in COMMANDS.items():
    app.command(_path, name=_name, help=_help)
_log = App(name="log", help=LOG_HELP)
for _name, (_path, _help) in LOG_COMMANDS.items():
    _log.command(_path, name=_name, help=_help)
app.command(_log)
