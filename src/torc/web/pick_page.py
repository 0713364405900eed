"""Trials and picks as plain data for the page, whether a trial is being played or was recorded."""

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from jaxtyping import Int8
from scipy.ndimage import find_objects

from torc.drawing.graph_layout import lay_out
from torc.drawing.marking import number_places
from torc.drawing.palette import object_color
from torc.errors import InputError
from torc.records import MAX_OBJECTS, TARGET_ID, DependencyGraph, Evidence, GraspStatus
from torc.trials.log import LookedLine
from torc.trials.pick_view import LIKELY, ObjectView, PickView
from torc.trials.recorded import RecordedPick, RecordedTrial

MAX_EDGES = 1500
WHY_NOT = {
    GraspStatus.UNREACHABLE: "out of the arm's reach",
    GraspStatus.HITS_STATIC: "the arm would hit the table, the bin or itself",
    GraspStatus.SEVERAL_OBJECTS: "several objects between the fingers",
    GraspStatus.FINGERS_IN_OBJECT: "a finger would be inside the object",
    GraspStatus.NO_MOTION: "no motion was found in an earlier pick",
    GraspStatus.UNLIKELY: "too unlikely to succeed now",
    GraspStatus.NO_LINE: "no straight way to it, or up again",
}


def trial_page(trial: RecordedTrial) -> dict[str, Any]:
    """Return the trial, and a line per pick."""
    over, started = trial.result is not None, trial.started
    return {
        "problem": started.problem if started else trial.spec.problem,
        "planner": trial.spec.planner.asking,
        "expert": trial.spec.planner.expert,
        "seed": trial.spec.seed,
        "target": started.target_description if started else "",
        "result": trial.result.model_dump() if trial.result else None,
        "video": trial.video is not None,
        # What only the simulator knows is shown when nobody has to decide any more.
        "names": list(started.names) if started and over else [],
        "picks": [_pick_line(number, pick, over) for number, pick in enumerate(trial.picks)],
    }


def pick_page(trial: RecordedTrial, number: int) -> dict[str, Any]:
    """Return everything about one pick but its pictures and arrays. Raises InputError if there is no such pick."""
    pick, view = trial.pick(number), trial.view(number)
    over, decided = trial.result is not None, pick.decided
    evidence = decided.evidence if decided else Evidence()
    graph, own = evidence.graph, evidence.graph is not None
    if graph is None and view is not None:
        with suppress(InputError):  # it cannot be read
            graph = DependencyGraph.from_dict(view.graph)
    graphs = None if graph is None else _graphs(graph, evidence.probabilities)
    plain = trial.has_plain_picture(number)
    return {
        **_pick_line(number, pick, over),
        "objects": _objects(pick.looked, view, plain, trial.started.names if trial.started and over else ()),
        # Without the camera's own picture the page shows the one in which the marks are drawn.
        "plain": plain,
        "likely": LIKELY,
        "target_visible": pick.looked.target_visible,
        # If the target was not recognised, a person may point it out.
        "may_name_target": bool(pick.looked.true_ids) and not pick.looked.target_visible,
        "max_picks": trial.started.max_picks if trial.started else None,
        "graphs": graphs,
        "graph_by": "the planner" if own else "geometry",
        "arrays": view is not None,
        "decision": decided.model_dump(exclude={"event", "pick"}) if decided else None,
        "sent": trial.sent_pictures(number),
        "plan": pick.planned.model_dump(exclude={"event", "pick"}) if pick.planned else None,
    }


def _pick_line(number: int, pick: RecordedPick, over: bool) -> dict[str, Any]:
    """Return choice and outcome; while a person decides, only what any planner knows of earlier picks."""
    decided, executed = pick.decided, pick.executed
    line: dict[str, Any] = {
        "pick": number,
        "chosen": decided.object_id if decided else None,
        "result": (executed.result if over else executed.felt_result) if executed else None,
    }
    if over and executed:
        line["outcome"] = executed.model_dump(exclude={"event", "pick"})
    return line


def _objects(
    looked: LookedLine, view: PickView | None, plain: bool, names: Sequence[str]
) -> list[dict[str, Any]]:
    """Return the facts of each object in sight; `names` by the simulator's ids, which perception's may not be."""
    boxes = find_objects(view.label_image.astype(int) + 1) if view else []
    tags = find_tags(view.label_image, [o.id for o in looked.objects], outlines=plain) if view else {}
    detailed = {o.id: o for o in view.objects} if view else {}
    rows = []
    for seen in looked.objects:
        valid, o = looked.valid_grasps.get(str(seen.id), 0), detailed.get(seen.id)
        blocked = {b.by: b.grasps for b in looked.blocking if b.object == seen.id}
        true_id = looked.true_ids.get(str(seen.id), seen.id)
        rows.append(
            {
                "id": seen.id,
                "name": names[true_id] if 0 <= true_id < len(names) else "",
                "target": looked.target_visible and seen.id == looked.target_id,
                "color": _hex_color(TARGET_ID if seen.id == looked.target_id else seen.id),
                "pixels": seen.pixels,
                "graspable": seen.id in looked.graspable,
                "valid": valid,
                "blocked": o.statuses.get(GraspStatus.BLOCKED.name.lower(), 0) if o else None,
                "likely_if_free": o.likely_if_free if o else None,
                "blockers": [{"id": k, "grasps": n} for k, n in sorted(blocked.items(), key=lambda b: -b[1])],
                "why_not": "" if valid else why_not(o),
                "score": o.best_score if o else None,
                "hides_l": o.hidden_volume_m3 * 1000 if o else None,
                "box": _box(boxes[seen.id]) if seen.id < len(boxes) else None,
                "tag": tags.get(seen.id),
            }
        )
    return rows


def why_not(o: ObjectView | None) -> str:
    """Say why an object has no valid grasp, apart from what blocks it; the most frequent reasons first."""
    if o is None:
        return ""
    if not o.statuses:
        return "no grasp was found on it"
    counts = [
        (n, words) for status, words in WHY_NOT.items() if (n := o.statuses.get(status.name.lower(), 0))
    ]
    return "; ".join(f"{n} {words}" for n, words in sorted(counts, key=lambda c: -c[0]))


def _box(place: tuple[slice, slice] | None) -> list[int] | None:
    return [place[1].start, place[0].start, place[1].stop - 1, place[0].stop - 1] if place else None


def _graphs(graph: DependencyGraph, probabilities: Mapping[int, float]) -> dict[str, Any] | None:
    """Lay out `all` of a graph, and `target`, the part that the target waits for; None if it is too large to draw."""
    if len(graph.nodes) > MAX_OBJECTS + 1 or len(graph.edges) > MAX_EDGES:
        return None
    parts = {"all": graph, "target": _what_the_target_waits_for(graph)}
    return {name: _drawn_graph(part, probabilities) for name, part in parts.items()}


def _what_the_target_waits_for(graph: DependencyGraph) -> DependencyGraph:
    """Return the part of a graph with the target and everything that has to go before it, directly or not."""
    found = [graph.target]
    for node in found:  # which grows
        found += {e.target for e in graph.out_edges(node)}.difference(found)
    nodes = tuple(n for n in graph.nodes if n.id in found)
    return DependencyGraph(nodes, tuple(e for e in graph.edges if e.source in found), graph.target)


def _drawn_graph(graph: DependencyGraph, probabilities: Mapping[int, float]) -> dict[str, Any]:
    layout = lay_out(graph)
    nodes = []
    for n in graph.nodes:
        p = probabilities.get(n.id)
        facts = {
            "id": n.id,
            "color": _hex_color(TARGET_ID if n.id == graph.target else n.id),
            "hidden": n.hidden,
            "graspable": n.graspable,
        }
        nodes.append(
            {**facts, "place": layout.places[n.id], "p": p if p is not None and 0 <= p <= 1 else None}
        )
    edges = [
        edge | {"route": layout.routes[edge["source"], edge["target"]]} for edge in graph.to_dict()["edges"]
    ]
    return {
        "target": graph.target,
        "columns": layout.columns,
        "rows": layout.rows,
        "nodes": nodes,
        "edges": edges,
    }


def _hex_color(object_id: int) -> str:
    return "#{:02x}{:02x}{:02x}".format(*object_color(object_id))


def find_tags(
    label_image: Int8[np.ndarray, "h w"], ids: Collection[int], *, outlines: bool
) -> dict[int, dict[str, Any]]:
    """Return, by id, where a number is written: like `mark_image` or, with `outlines`, like `mark_pixels`.

    `box` is (left, top, width, height), `anchor` the object's pixel (column, row), and `leader` says whether a line
    ties the two.
    """
    label = np.where(np.isin(label_image, list(ids)), label_image, -1).astype(np.int16)
    places = number_places(label, {i: i for i in ids}, small=outlines)
    return {
        i: {
            "box": [p.col, p.row, p.size[1], p.size[0]],
            "anchor": [p.anchor[1], p.anchor[0]],
            "leader": p.leader,
        }
        for i, p in places.items()
    }
