"""The tables of the report, before anybody makes HTML or Markdown of them."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from torc.benchmark.comparison import ALPHA, Comparison, compare_all, holm
from torc.benchmark.measures import DECISION_S, DROP_FREE, GRASPS, MEASURES, SUCCESS, attempts, ends, promises
from torc.benchmark.paper import paper_method
from torc.benchmark.ranking import Standing
from torc.benchmark.report.cells import TextTable, outcome, p_text, seconds_text, signed_text, trial_cell
from torc.benchmark.rows import Table, TrialRow

CATEGORIES = ("structured", "unstructured")
_HIDDENNESS = ("visible", "partly", "hidden")
_STANDING = (
    *("planner", "picks to retrieval", "more than the best", "retrieved", "with no drop", "drops"),
    *("decision, s", "trials", "errored"),
)


def ranking_table(standings: Sequence[Standing], table: Table, comparable: bool = True) -> TextTable:
    """A row per planner that competes, best first; without ranks where they are not comparable."""
    ranked = [s for s in standings if not s.reference]
    rows = [
        (f"{place}" if s.completed and comparable else "-", *_standing_cells(s, table))
        for place, s in enumerate(ranked, start=1)
    ]
    note = (
        "Picks to retrieval: mean, a trial that never got the target counting as its whole budget (the paper's primary "
        "objective); more than the best: on the same problems and seeds, a tie where p is .05 or more; drops: mean "
        "(the secondary one); decision: median. Brackets: 95 % intervals over problems."
    )
    return TextTable("Ranking", ("rank", *_STANDING), rows, note)


def references_table(standings: Sequence[Standing], table: Table) -> TextTable:
    """The same of those that do not compete."""
    note = (
        "To compare with, not to use. They know more than planners are told: the simulation (the oracle, a simulated "
        "model, any planner that took hold of it), or, of a person, the view from outside."
    )
    rows = [_standing_cells(s, table) for s in standings if s.reference]
    return TextTable("References, not ranked", _STANDING, rows, note)


def _standing_cells(s: Standing, table: Table) -> tuple[str, ...]:
    done = table.completed(s.planner)
    gap = "" if s.behind is None else signed_text(s.behind.cost, 1)
    if s.behind is not None and s.p is not None:
        gap += f", p {p_text(s.p, s.behind.p_is_a_bound)}"
    return (
        *(s.planner, s.cost.text(1), gap + (" (a tie)" if s.ties else ""), s.success.text()),
        *(DROP_FREE.of(done).text(), s.drops.text(), seconds_text(DECISION_S.of(done))),
        *(f"{s.completed} of {s.planned}", f"{100 * s.errored:.0f} %"),
    )


def measures_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Every measure, structured and unstructured scenes apart."""
    rows = []
    for planner in planners:
        for category in (None, *CATEGORIES):
            if done := table.completed(planner, category):
                numbers = [m.of(done).text(m.digits) for m in MEASURES]
                rows.append((planner, category or "all", str(len(done)), *numbers))
    note = "; ".join(f"{m.name}: {m.help}" for m in MEASURES) + ". Brackets: 95 % intervals over problems."
    return TextTable("All measures", ("planner", "scenes", "trials", *(m.name for m in MEASURES)), rows, note)


def paper_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Ours beside the paper's, for the methods that it has."""
    rows = []
    for planner in planners:
        method, done = paper_method(planner), table.completed(planner)
        if method is None or not done:
            continue
        low, high = method.success_95
        successes = _median([r.picks for r in done if r.retrieved])
        pairs = (
            (SUCCESS.of(done).text(), f"{method.success:.2f} [{low:.2f}, {high:.2f}]"),
            (DROP_FREE.of(done).text(), f"{method.drop_free:.2f}"),
            (
                f"{successes} / {_median([r.picks for r in done])}",
                f"{method.picks_success:g} / {method.picks:g}",
            ),
            (_median([r.drops for r in done]), f"{method.drops:g}"),
            (GRASPS.of(done).text(), f"{method.grasps_held:.2f}"),
        )
        rows.append((planner, *(cell for pair in pairs for cell in pair)))
    names = ("retrieved", "with no drop", "median picks, successes / all", "median drops", "grasps held")
    header = ("planner", *(f"{name}, {whose}" for name in names for whose in ("here", "the paper")))
    note = "Other problems, another grasp planner and another simulation: the paper's values are no target."
    return TextTable("Beside the paper", header, rows, note)


def comparison_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Every pair of planners on the same problems and seeds."""
    found = [c for c in compare_all(table, [p for p in planners if table.completed(p)]) if c.pairs]
    rows = []
    for c, p in zip(found, holm([c.p_cost for c in found])):
        pair, told = f"{c.first} - {c.second}", p_text(p, c.p_is_a_bound)
        gaps = signed_text(c.success, 2), signed_text(c.drops, 2)
        rows.append((pair, str(c.pairs), signed_text(c.cost, 1), told, *gaps, _better(c, p)))
    header = ("pair", "trials of both", "picks to retrieval", "p", "retrieved", "drops", "by picks")
    note = (
        "Differences on the same problem and seed with 95 % intervals over problems; p: permutation test over "
        "problems, corrected for the number of pairs (Holm)."
    )
    return TextTable("Planner against planner", header, rows, note)


def _better(c: Comparison, p: float) -> str:
    if not p < ALPHA:
        return "cannot be told"
    return f"{c.second if c.cost.value > 0 else c.first} is better"


def causes_tables(table: Table, planners: Sequence[str]) -> list[TextTable]:
    """How attempts and trials ended."""
    tables = []
    for title, count in (("How trials ended", ends), ("How attempts ended", attempts)):
        counts = {p: count(table.completed(p)) for p in planners}
        names = [name for name, _ in sum(counts.values(), Counter()).most_common()]
        rows = [
            (p, *(f"{c[n]} ({100 * c[n] / c.total():.0f} %)" if c[n] else "" for n in names))
            for p, c in counts.items()
            if c.total()
        ]
        tables.append(TextTable(title, ("planner", *names), rows))
    return tables


def promises_table(table: Table, planners: Sequence[str]) -> TextTable:
    """What the grasps promised, and what came of them."""
    rows = []
    for planner in planners:
        for low, high, picks in promises(table.completed(planner)):
            if picks:
                means = np.array([(p.p, p.held, p.delivered) for p in picks], dtype=float).mean(axis=0)
                numbers = (f"{mean:.3f}" for mean in means)
                rows.append((planner, f"{low:g} to {high:g}", str(len(picks)), *numbers))
    header = ("planner", "p of the grasp", "carried out", "mean p", "held", "delivered")
    note = "p: the probability that the object is delivered, by the grasp's score and what failed before."
    return TextTable("Grasps: promised and delivered", header, rows, note)


def times_table(table: Table, planners: Sequence[str]) -> TextTable:
    """Wall seconds by step."""
    steps = {
        "image to grasps": "grasps_s",
        "decision": "decision_s",
        "motion plans": "motions_s",
        "robot's own time": "robot_s",
    }
    rows = []
    for planner in planners:
        picks = [p for r in table.completed(planner) for p in r.picked]
        for name, field in steps.items():
            values = [seconds for p in picks if (seconds := getattr(p, field)) > 0]
            if values:
                median, high = np.percentile(values, (50, 95))
                rows.append((planner, name, str(len(values)), f"{median:.3f}", f"{high:.3f}"))
    header = ("planner", "step", "picks", "median, s", "95th percentile, s")
    return TextTable("Time of a pick by step", header, rows)


def problems_table(table: Table, planners: Sequence[str]) -> TextTable:
    """A row per problem: what each planner did on it."""
    shown = [p for p in planners if table.completed(p)]
    rows = []
    for problem in table.problems:
        here, stated = [r for r in table.rows if r.problem == problem], table.difficulties.get(problem)
        facts = ("", "", "")
        if stated is not None:
            facts = str(stated.objects), stated.hiddenness.value, f"{100 * stated.visible_fraction:.0f}"
        cells = (_problem_cell([r for r in here if r.planner == p and r.completed]) for p in shown)
        rows.append((problem, here[0].category, *facts, *cells))
    header = ("problem", "scenes", "objects", "target", "% in sight", *shown)
    note = "Retrieved of completed trials; median picks with their range; mean drops."
    return TextTable("Every problem", header, rows, note)


def _problem_cell(done: Sequence[TrialRow]) -> str:
    if not done:
        return ""
    picks, drops = [r.picks for r in done], np.mean([r.drops for r in done])
    spread = f" ({min(picks)}-{max(picks)})" if min(picks) < max(picks) else ""
    retrieved = sum(r.retrieved for r in done)
    return f"{retrieved}/{len(done)}, {np.median(picks):g}{spread} picks, {drops:.2g} drops"


def difficulty_table(table: Table) -> TextTable:
    """What the problems are like, as their files say."""
    category = {r.problem: r.category for r in table.rows}
    rows = []
    for group in ("all", *CATEGORIES):
        mine = [d for name, d in table.difficulties.items() if group in ("all", category[name])]
        if not mine:
            continue
        hidden = " / ".join(str(sum(d.hiddenness.value == h for d in mine)) for h in _HIDDENNESS)
        numbers = [(d.objects, 100 * d.visible_fraction, d.in_front, d.beside, d.taller) for d in mine]
        objects, *others = (f"{np.median(c):.3g} ({min(c):.0f}-{max(c):.0f})" for c in zip(*numbers))
        rows.append((group, str(len(mine)), objects, hidden, *others))
    header = (
        *("scenes", "problems", "objects", f"targets {' / '.join(_HIDDENNESS)}", "% in sight"),
        *("in front", "beside", "taller"),
    )
    return TextTable("The problems", header, rows, "Medians with their range.")


def errors_table(table: Table) -> TextTable:
    """The errored trials: never scored."""
    rows = []
    for r in table.rows:
        if r.status not in ("completed", "missing"):
            said = next((line for line in r.error.splitlines() if line.strip()), "")
            said = said if len(said) <= 200 else f"{said[:197]}..."
            rows.append((r.planner, r.problem, str(r.seed), r.cause, said, trial_cell(table, r)))
    header = ("planner", "problem", "seed", "cause", "what was said", "trial")
    return TextTable("Errored trials, which are not scored", header, rows)


def trials_table(table: Table) -> TextTable:
    """Every trial that was played, with a link into the viewer."""
    rows = []
    for r in table.rows:
        if r.status != "missing":
            counts = (str(r.picks), str(r.drops)) if r.completed else ("", "")
            rows.append((r.planner, r.problem, str(r.seed), outcome(r), *counts, trial_cell(table, r)))
    header = ("planner", "problem", "seed", "outcome", "picks", "drops", "trial")
    return TextTable("Every trial", header, rows)


def _median(values: Sequence[float]) -> str:
    return f"{np.median(values):g}" if len(values) else "-"
