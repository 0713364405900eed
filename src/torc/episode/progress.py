"""Show live progress in the terminal: each pick, its reason, its result and its time."""

from rich.console import Console
from rich.markup import escape
from rich.status import Status

from torc.episode.events import Decided, Ended, Event, Executed, Halted, Looked, Planned, Started
from torc.episode.identity import true_ids
from torc.records import PickPlan, PickResult, PlanFailure

_GOOD = (PickResult.RETRIEVED, PickResult.REMOVED)
_NEXT = {
    Started: "looking...",
    Looked: "deciding...",
    Decided: "planning the motions...",
    Planned: "the robot moves...",
    Executed: "looking...",
    Halted: "waiting for you...",
    Ended: "writing the results...",
}
"""What begins after each event."""


class TerminalProgress:
    """Prints a few lines per pick and, on a terminal, the current activity between them."""

    def __init__(self, console: Console, status: Status) -> None:
        """Take the console and its live line, which whoever runs the trial shows."""
        self.console, self.status = console, status
        self.names: tuple[str, ...] = ()
        self.true_ids: dict[int, int] = {}
        """True id per object in sight, if perception has its own ids."""

    def __call__(self, event: Event) -> None:
        """Print one event."""
        self.status.update(_NEXT[type(event)])
        match event:
            case Started():
                self.names = event.names
                asking = f" asking {escape(event.vlm)}" if event.vlm else ""
                self._line(
                    f"[bold]{escape(event.problem)}[/]: retrieve [bold]{escape(event.target_description)}[/] with "
                    f"{escape(event.planner)}{asking}, seed {event.seed}, at most {event.max_picks} picks"
                )
                if gone := ", ".join(map(self._name, event.absent)):
                    self._line(
                        f"  [yellow]off the table before the first pick, and out of the scene: {gone}[/]"
                    )
            case Looked():
                context = event.look.context
                self.true_ids = true_ids(event.look)
                target = "target in sight" if context.scene.target_id is not None else "target hidden"
                self._line(
                    f"\n[bold]pick {event.pick + 1}[/]  {len(context.scene.objects)} objects in sight, {target}, "
                    f"{len(context.report.graspable_ids)} graspable {_time(event.seconds)}"
                )
            case Decided():
                chosen = event.decision.object_id
                choice = "no choice" if chosen is None else self._seen(chosen)
                self._line(f"  decide   {choice}: {escape(event.decision.reason)} {_time(event.seconds)}")
            case Planned(plan=PickPlan() as plan):
                score = event.look.context.grasps.scores[plan.grasp_index]
                self._line(
                    f"  motion   grasp {plan.grasps_tried} of its list, succeeds with p = {score:.2f} "
                    f"{_time(event.seconds)}"
                )
            case Planned(plan=PlanFailure() as plan):
                reason = f"{plan.stage}: {escape(plan.reason)}"
                self._line(f"  motion   [yellow]none[/]: {reason} {_time(event.seconds)}")
            case Executed():
                color = "green" if event.outcome.result in _GOOD else "yellow"
                dropped = "".join(f", [red]dropped {self._name(k)}[/]" for k in event.outcome.dropped)
                detail = f": {escape(event.outcome.detail)}" if event.outcome.detail else ""
                self._line(
                    f"  result   [{color}]{event.outcome.result.value}[/]{detail}{dropped} {_time(event.seconds)}"
                )
            case Halted():
                self._line(f"  [bold red]halted[/]   {escape(event.reason)}")
            case Ended():
                r, verdict = event.result, "[bold green]retrieved[/]"
                if not r.retrieved:
                    verdict = f"[bold red]not retrieved[/] ({r.end.value})"
                self._line(f"\n{verdict} after {r.picks} picks, {len(r.dropped)} dropped")

    def _name(self, object_id: int) -> str:
        known = f" ({escape(self.names[object_id])})" if 0 <= object_id < len(self.names) else ""
        return f"{object_id}{known}"

    def _seen(self, object_id: int) -> str:
        """Name an object by perception's id and what it really is."""
        true_id = self.true_ids.get(object_id, object_id)
        name = self.names[true_id] if 0 <= true_id < len(self.names) else ""
        return f"{object_id} ({escape(name)})" if name else f"{object_id}"

    def _line(self, text: str) -> None:
        self.console.print(text, highlight=False)


def _time(seconds: float) -> str:
    return f"[dim]{seconds:.2f} s[/]"
