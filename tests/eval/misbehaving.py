"""Planners that misbehave, each written to a file of its own.

A case is a place (import, construct, reset, act, close) and what happens there, or an
answer of `act`. `why` is what the row must say; None if the planner goes on, and then
drives so slowly that it arrives nowhere.
"""

from pathlib import Path
from typing import NamedTuple

PLACES = ("import", "construct", "reset", "act")

_TEMPLATE = """
import atexit, ctypes, gc, itertools, os, signal, sys, threading, time, warnings
from dataclasses import dataclass, replace
import numpy as np
from beacon_mj.interface import Command, PlannerInfo
from beacon_mj.planners.base import Planner

class BadStr(Exception):
    def __str__(self): raise ValueError("no text")

def deep(): return deep()

def misbehave(task=None, seen=None):
{code}

if "{place}" == "import": misbehave()

@dataclass(frozen=True, kw_only=True, slots=True)
class Config:
    pass

class {name}(Planner):
    Config = Config
    def __init__(self, config=None):
        super().__init__(config)
        if "{place}" == "construct": misbehave()
    def reset(self, task):
        self.task, self.decisions = task, 0
        if "{place}" == "reset": misbehave(task)
    def act(self, observation):
        self.decisions += 1
        if "{place}" == "act" and self.decisions == 3: misbehave(self.task, observation)
        slow = Command(velocity_mps=np.array([0.01, 0.0]))
        return {answer}
"""


class Case(NamedTuple):
    """One planner: its code, where that runs, and what its row must say."""

    name: str
    place: str
    code: str
    why: str | None
    answer: str = "slow"

    def write(self, folder: Path) -> str:
        """Write the planner's file; return what it is loaded by."""
        lines = "\n".join("    " + line for line in self.code.split("\n"))
        text = _TEMPLATE.format(
            code=lines, place=self.place, name=self.name, answer=self.answer
        )
        path = folder / f"{self.name.lower()}.py"
        path.write_text(text)
        return f"{path}:{self.name}"


_RAISED = {
    "ValueError": ("raise ValueError('by hand')", "ValueError: by hand"),
    "Exit": ("raise SystemExit(0)", "SystemExit: 0"),
    "Interrupt": ("raise KeyboardInterrupt", "KeyboardInterrupt"),
    "Generator": ("raise GeneratorExit", "GeneratorExit"),
    "Base": ("raise BaseException('base')", "BaseException: base"),
    "Group": (
        "raise BaseExceptionGroup('many', [KeyboardInterrupt(), ValueError('v')])",
        "BaseExceptionGroup: many",
    ),
    "BadText": ("raise BadStr", "BadStr: (no text: ValueError in its __str__)"),
    "Surrogate": (
        r"raise FileNotFoundError(2, 'none', 'map_\udcff.png')",
        r"map_\udcff.png",
    ),
    "Huge": ("raise RuntimeError('x' * 30_000_000)", "RuntimeError: xxx"),
    "Controls": (r"raise RuntimeError('a\0b\x1b[31mred')", r"a\x00b\x1b[31mred"),
    "Recursion": ("deep()", "RecursionError"),
    "Stops": ("raise StopIteration", "StopIteration"),
}
LATE = "TimeoutError: no "
_LOOPS = {
    "Loop": ("while True: pass", LATE),
    "Swallows": (
        "while True:\n    try:\n        while True: pass\n"
        "    except BaseException: pass",
        LATE,
    ),
    "Compiled": ("sum(itertools.repeat(0))", LATE),
    "Disarms": (
        "signal.setitimer(signal.ITIMER_REAL, 0)\n"
        "signal.signal(signal.SIGALRM, signal.SIG_IGN)\nwhile True: time.sleep(60)",
        LATE,
    ),
}
_ENDS = {
    "LeavesZero": ("os._exit(0)", "process died: exit status 0"),
    "Leaves": ("os._exit(3)", "process died: exit status 3"),
    "Killed": ("os.kill(os.getpid(), signal.SIGKILL)", "process died: SIGKILL"),
    "Aborts": ("os.abort()", "process died: SIGABRT"),
    "Crashes": ("ctypes.string_at(0)", "process died: SIGSEGV"),
    "Hangup": ("os.closerange(0, 1000)", "process died"),
    "Fills": ("hoard = []\nwhile True: hoard.append(bytearray(2**26))", "MemoryError"),
    "Asks": ("bytearray(2**50)", "MemoryError"),
}
_ANSWERS = {
    "Nothing": ("None", "to return a Command but it was NoneType"),
    "Pair": ("(0.1, 0.0)", "to return a Command but it was tuple"),
    "Text": ("'stop'", "to return a Command but it was str"),
    "Class": ("Command", "to return a Command but it was type"),
}
_VELOCITIES = {
    "Nan": "np.array([np.nan, 0.0])",
    "Infinite": "(np.inf, 0.0)",
    "Enormous": "(1e300, 1e300)",
    "Three": "np.zeros(3)",
    "Scalar": "0.1",
    "Column": "np.zeros((2, 1))",
    "Complex": "np.array([1j, 0])",
    "Texts": "np.array(['1', '0'])",
    "Objects": "np.array([0.1, None], dtype=object)",
    "Bools": "np.array([True, False])",
    "NoVelocity": "None",
    "Ragged": "[[0.1], [0.0, 1.0]]",
    "Bytes": "b'12'",
    "Dates": "np.array(['2020', '2021'], dtype='M8[Y]')",
}
_INFOS = {
    "Action": ("action='fly'", "info.action to be one of move"),
    "ActionType": ("action=3", "info.action to be a text"),
    "LongReason": ("reason='x' * 5000", "info.reason to be at most"),
    "LoneReason": (r"reason='lost \udcff'", "a UTF-8 form"),
    "NoReason": ("reason=None", "info.reason to be a text"),
    "Target": ("target='nobody'", "info.target to be a sensed obstacle"),
    "CostText": ("cost_push='1'", "info.cost_push to be a real number"),
    "CostNan": ("cost_detour=float('nan')", "info.cost_detour to be a number"),
    "CostComplex": ("cost_push=1j", "info.cost_push to be a real number"),
    "TermsList": ("terms=[1.0]", "info.terms to be a mapping"),
    "TermText": ("terms={'a': 'b'}", "info.terms to be a real number"),
    "TermName": ("terms={3: 1.0}", "a name in info.terms to be a text"),
    "TermsMany": ("terms={str(k): 1.0 for k in range(1000)}", "at most 100 entries"),
    "PathShape": ("path_m=np.zeros((2, 3))", "info.path_m of shape (m, 2)"),
    "PathNan": ("path_m=np.full((2, 2), np.nan)", "info.path_m to be finite"),
    "PathText": ("path_m='home'", "info.path_m of shape (m, 2)"),
    "PathLong": ("path_m=np.zeros((10**6, 2))", "at most 10000 points"),
    "BeliefUnknown": ("beliefs={'nobody': (1.0, 0.0, 0.0)}", "was not sensed"),
    "Expansions": ("expansions=-1", "info.expansions to be between"),
    "ExpansionsReal": ("expansions=1.5", "info.expansions to be a whole number"),
    "Replanned": ("replanned='yes'", "info.replanned to be true or false"),
}
_WRITES = {
    "MovesGoal": ("task.goal_m[:] = task.start_m", "read-only"),
    "SubtractsInPlace": ("d = task.goal_m\nd -= seen.position_m", "read-only"),
    "Unlocks": ("task.goal_m.flags.writeable = True", "cannot set WRITEABLE"),
    "UnlocksBase": ("task.goal_m.base[0] = 0", "does not support item assignment"),
    "MovesPosition": ("seen.position_m[:] = task.goal_m", "read-only"),
    "FrozenField": ("seen.time_s = 0.0", "FrozenInstanceError"),
    "ForcesGoal": ("object.__setattr__(task, 'goal_m', task.start_m)", None),
    "ForcesTolerance": ("object.__setattr__(task, 'goal_tolerance_m', 99.0)", None),
    "ForcesPosition": (
        "object.__setattr__(seen, 'position_m', task.goal_m)",
        None,
    ),
    # NumPy 2.5 warns of it, and does it.
    "ForcesShape": (
        "warnings.simplefilter('ignore'); task.goal_m.shape = (2, 1)",
        None,
    ),
}
_STATES = {
    "ChangesFolder": "os.makedirs('elsewhere', exist_ok=True); os.chdir('elsewhere')",
    "RaisesInNumpy": "np.seterr(all='raise')",
    "WarningsAreErrors": "warnings.simplefilter('error')",
    "ShallowStack": "sys.setrecursionlimit(200)",
    "ClearsEnvironment": "os.environ.clear()",
    "StopsCollecting": "gc.disable()",
    "MasksFiles": "os.umask(0o777)",
    "NoStdout": "sys.stdout = None",
    "IgnoresInterrupts": "signal.signal(signal.SIGINT, signal.SIG_IGN)",
}
_WORSE_STATES = {
    "ClosesStdout": "sys.stdout.close()",
    "ClosesStreams": "os.closerange(0, 3)",
    "Talks": "print('thinking', flush=True); os.write(1, b'thinking')",
    "Forks": "os.fork()",
    "NoPath": "sys.path.clear()",
    "LeavesThread": "threading.Thread(target=time.sleep, args=(600,)).start()",
    "EndsLate": "atexit.register(lambda: time.sleep(600))",
    "LowPriority": "os.nice(10)",
}
_CLOSES = {
    "DeletesLoudly": "raise ValueError('in __del__')",
    "DeletesForEver": "while True: pass",
    "DeletesByExit": "os._exit(3)",
}


def raising() -> list[Case]:
    """Return every exception at every place."""
    return [
        Case(f"{what}At{place.title()}", place, code, why)
        for place in PLACES
        for what, (code, why) in _RAISED.items()
    ]


def loops() -> list[Case]:
    """Return every loop at every place."""
    return [
        Case(f"{what}At{place.title()}", place, code, why)
        for place in PLACES
        for what, (code, why) in _LOOPS.items()
    ]


def ends() -> list[Case]:
    """Return every end of a process, and every want of memory, at every place."""
    return [
        Case(f"{what}At{place.title()}", place, code, why)
        for place in PLACES
        for what, (code, why) in _ENDS.items()
    ]


def answers() -> list[Case]:
    """Return every unsound answer."""
    out = [Case(n, "", "pass", why, code) for n, (code, why) in _ANSWERS.items()]
    out += [
        Case(n, "", "pass", "finite velocity of shape (2,)", _command(value))
        for n, value in _VELOCITIES.items()
    ]
    out += [
        Case(n, "", "pass", why, f"replace(slow, info=PlannerInfo({field}))")
        for n, (field, why) in _INFOS.items()
    ]
    text = "replace(slow, give_up='no')"
    out.append(Case("GivesUpText", "", "pass", "give_up to be true or false", text))
    out.append(Case("InfoDict", "", "pass", "a PlannerInfo", "replace(slow, info={})"))
    return out


def writes() -> list[Case]:
    """Return everything that is written to an input."""
    return [Case(n, "act", code, why) for n, (code, why) in _WRITES.items()]


def states() -> list[Case]:
    """Return what is done to the process that can be undone."""
    return [Case(n, "reset", code, None) for n, code in _STATES.items()]


def worse_states() -> list[Case]:
    """Return what is done to the process that only another process survives."""
    return [Case(n, "reset", code, None) for n, code in _WORSE_STATES.items()]


def closes() -> list[Case]:
    """Return what happens when the planner is thrown away."""
    return [
        Case(n, "close", _DELETE.format(code=code), None) for n, code in _CLOSES.items()
    ]


_DELETE = "pass\n\nclass Late:\n    def __del__(self):\n        {code}\nlate = Late()"


def _command(velocity: str) -> str:
    return f"Command(velocity_mps={velocity})"
