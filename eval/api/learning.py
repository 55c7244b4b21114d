"""Savings by learning: certified, of the optimum in the actual worlds, realised."""

from pathlib import Path

from beacon_mj.eval.statistics.results import Source, results_of
from beacon_mj.eval.studies.learning import savings
from beacon_mj.eval.studies.learning_table import LearningSavings


def learning_savings(
    run: Source, *, without: str, learner: str, plot: str | Path | None = None
) -> LearningSavings:
    """Compare what learning saved with what it saves the optimum in the same worlds.

    The same as `beacon-mj learning`; `beacon_mj.eval.studies.learning` has the
    equations.

    Args:
        run: Results or a run folder, on families with a certificate of learning.
        without: The planner of the run that does not learn.
        learner: The one that does.
        plot: SVG, PNG or PDF file for the figure, one point a scene.

    Raises:
        RunError: If the run has no such planners or scenes, or the figure's name ends
            in something else.
    """
    found = LearningSavings(
        without, learner, savings(results_of(run), without, learner)
    )
    if plot is not None:
        # Only now: matplotlib takes half a second to import.
        from beacon_mj.eval.report.learning_figure import write_scatter

        write_scatter(found.scenes, found.families, Path(plot))
    return found
