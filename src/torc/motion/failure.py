"""How a query of a pick says that it found nothing; the planner turns it into a PlanFailure."""

from torc.records import PlanStage


class NoMotionError(Exception):
    """A motion query found nothing.

    Attributes:
        stage: which query.
        reason: one sentence.
    """

    def __init__(self, stage: PlanStage, reason: str) -> None:
        super().__init__(reason)
        self.stage, self.reason = stage, reason
