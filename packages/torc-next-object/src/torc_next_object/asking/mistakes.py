"""Write the page of a model's worst mistakes: picture, choice, and what would have been best."""

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

from torc.io.pictures import data_url
from torc_next_object.asking.evaluation import RecordedReply
from torc_next_object.replies import read_number
from torc_next_object.scoring import Scored, score_answer

Row = Mapping[str, Any]
Mistake = tuple[Row, RecordedReply, Scored]
_LONGEST_REPLY = 3_000
_STYLE = """
body { font: 16px/1.45 system-ui, sans-serif; margin: 1.5rem auto; max-width: 72rem; padding: 0 1rem; color: #1a1a1a;
  background: #fff }
article { display: grid; grid-template-columns: 3fr 2fr; gap: 1.2rem; margin: 1.6rem 0; border-top: 1px solid #bbb;
  padding-top: 1rem }
@media (max-width: 50rem) { article { grid-template-columns: 1fr } }
img { width: 100%; height: auto; display: block }
.references img { width: 31%; display: inline-block; margin-top: .4rem }
h2 { font-size: 1.05rem; margin: 0 0 .5rem }
td, th { padding: .15rem .9rem .15rem 0; text-align: left; font-weight: normal }
.best { color: #06603a; font-weight: 600 }
.chosen { color: #9a1b1b; font-weight: 600 }
pre { white-space: pre-wrap; overflow-wrap: anywhere; background: #f3f3f3; padding: .6rem; max-height: 16rem;
  overflow: auto; font-size: .85rem }
"""


def worst_mistakes(rows: Sequence[Row], replies: Mapping[str, RecordedReply], most: int) -> list[Mistake]:
    """Return the answers that lose the most picks, the worst first; of equal ones those with a valid number first."""
    found = []
    for row in rows:
        reply = replies.get(str(row["id"]))
        if reply is not None:
            scored = score_answer(row, read_number(reply.reply, list(row["numbers"])))
            if not scored.top1:
                found.append((row, reply, scored))
    found.sort(key=lambda mistake: (-mistake[2].lost, mistake[2].number is None, mistake[2].id))
    return found[:most]


def mistakes_page(title: str, mistakes: Sequence[Mistake]) -> str:
    """Return one HTML file that needs nothing else and runs no script; all text of models and data is escaped."""
    order = "The worst first." if mistakes else "There is none: every answer was one of the best choices."
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>\n<body><h1>{escape(title)}</h1>\n"
        f"<p>Numbers are expected picks until the target is delivered, this one included. {order}</p>\n"
        + "\n".join(_article(row, reply, scored) for row, reply, scored in mistakes)
        + "\n</body></html>\n"
    )


def _article(row: Row, reply: RecordedReply, scored: Scored) -> str:
    chose = "No valid choice" if scored.number is None else f"Chose {scored.number}"
    where = "hidden" if row["target_hidden"] else "visible as 0"
    references = "".join(_picture(picture, "the target alone") for picture in row["references"] or ())
    # The answer is at the end; control characters are not HTML.
    end = reply.reply[-_LONGEST_REPLY:]
    text = "".join(c if c.isprintable() or c in "\n\t" else "\ufffd" for c in end)
    return (
        f'<article id="{escape(scored.id)}"><div>{_picture(row["image"], "what the model saw")}'
        f'<div class="references">{references}</div></div><div>'
        f"<h2>{chose}: {scored.lost:.2f} picks lost</h2>"
        f"<p>Target: {escape(str(row['description']))}, {where}. "
        f"Decision {escape(scored.id)}, reply {escape(str(reply.finish))}.</p>"
        f"{_values(row, scored.number)}<pre>{escape(text) or '(empty)'}</pre>"
        "</div></article>"
    )


def _values(row: Row, number: int | None) -> str:
    lines = []
    choices = zip(row["numbers"], row["values"], row["graspable"])
    for n, value, graspable in sorted(choices, key=lambda choice: (choice[1], choice[0])):
        notes = {"best": n in row["best"], "chosen": n == number, "no grasp": not graspable}
        kinds = [note for note, holds in notes.items() if holds]
        lines.append((" ".join(kinds[:1]), n, value, ", ".join(kinds)))
    if number is None:
        lines.append(("chosen", "none", row["random_value"], "counts as random"))
    cells = "".join(
        f'<tr class="{kind}"><td>{n}</td><td>{value:.2f}</td><td>{notes}</td></tr>'
        for kind, n, value, notes in lines
    )
    return f"<table><tr><th>object</th><th>expected picks</th><th></th></tr>{cells}</table>"


def _picture(picture: bytes, what: str) -> str:
    return f'<img alt="{what}" src="{data_url(picture)}">'
