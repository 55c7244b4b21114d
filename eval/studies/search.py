"""Search beyond Table I's grid, with optuna's tree-structured Parzen estimator.

Bergstra et al., "Algorithms for Hyper-Parameter Optimization", 2011. The grid's scores
are the first trials. Trials stand in a journal and each samples from a generator of its
own number, so that an interrupted search goes on as if nothing had happened.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from beacon_mj.errors import RunError
from beacon_mj.eval.studies.parameter_grid import Changes, Swept
from beacon_mj.eval.studies.sweep import Score, SweepRequest, swept_lines
from beacon_mj.extras import missing

JOURNAL = "optuna.journal"
#: Ranges beyond Table I's values: from half the smallest to twice the largest, but for
#: the radius, whose largest value no gap of our families lets through.
RADIUS_M = (0.10, 0.45)

Try = Callable[[int, Changes], Score]


def search(
    request: SweepRequest, out: Path, found: Sequence[Score], tried: Try
) -> list[Score]:
    """Return the scores of `request.trials` configurations that optuna suggests.

    Args:
        request: The sweep.
        out: Its folder, for the journal.
        found: Scores of the grid.
        tried: Scores a configuration, by its number.

    Raises:
        RunError: If optuna is not installed.
    """
    lines = swept_lines(request)
    study = _study(request, out / JOURNAL)
    known = _distributions(lines)
    for score in found[len(study.trials) :]:
        study.add_trial(_past(score, lines, known))
    scores = []
    for number in range(len(found), len(found) + request.trials):
        trial = _trial(study, number, request.select_seed, known)
        settings = {k: f"{v:.4g}" for k, v in trial.params.items()}
        scores.append(tried(number - len(found), settings))
        if not trial.state.is_finished():
            study.tell(number, merit(scores[-1]))
    return scores


def merit(score: Score) -> float:
    """Return one number with the order of the criterion: successes, then less energy.

    The second part is below 1, and one success counts 1.
    """
    count, less_energy = score.merit
    return count + 1.0 / (1.0 - less_energy)


def _study(request: SweepRequest, journal: Path) -> Any:
    try:
        import optuna
        from optuna.storages.journal import JournalFileBackend, JournalStorage
    except ImportError as error:
        raise RunError(f"--trials: {missing(error, 'sweep')}") from error
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna.create_study(
        storage=JournalStorage(JournalFileBackend(str(journal))),
        study_name=request.planner,
        direction="maximize",
        load_if_exists=True,
    )


def _distributions(lines: Sequence[Swept]) -> dict[str, Any]:
    from optuna.distributions import FloatDistribution

    ranges = {}
    for line in lines:
        try:
            values = [float(value) for value in line.values]
        except ValueError as error:
            raise RunError(
                f"--trials: expected numbers of {line.field} but they were "
                f"{', '.join(line.values)}."
            ) from error
        low, high = 0.5 * min(values), 2.0 * max(values)
        if line.field == "robot_radius_m":
            low, high = RADIUS_M
        ranges[line.field] = FloatDistribution(low, high)
    return ranges


def _past(score: Score, lines: Sequence[Swept], known: dict[str, Any]) -> Any:
    """Return a trial of the grid as optuna stores it."""
    from optuna.trial import create_trial

    values = {k.field: float(score.settings.get(k.field, k.default)) for k in lines}
    return create_trial(params=values, distributions=known, value=merit(score))


def _trial(study: Any, number: int, seed: int, known: dict[str, Any]) -> Any:
    """Return trial `number`: from the journal, or a new one."""
    from optuna.samplers import TPESampler
    from optuna.trial import Trial

    study.sampler = TPESampler(seed=seed + number)
    if number == len(study.trials):
        study.ask()
    trial = study.trials[number]
    if set(trial.params) != set(known):  # New, or cut off while it was sampled.
        live = Trial(study, trial._trial_id)
        for name, ends in known.items():
            live.suggest_float(name, ends.low, ends.high)
    return study.trials[number]
