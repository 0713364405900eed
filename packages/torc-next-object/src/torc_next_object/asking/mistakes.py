"""The page of a model's worst mistakes: picture, choice, and what would have been best."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from torc.io.pictures import data_url
from torc_next_object.asking.recorded_replies import RecordedReply
from torc_next_object.replies import read_number
from torc_next_object.scoring import score_answer

Row = Mapping[str, Any]
_LONGEST_REPLY = 3_000
_STYLE = """
body { font: 16px/1.45 system-ui, sans-serif; margin: 1.5rem auto; max-width: 72rem; padding: 0 1rem; color: #1a1a1a;
  background: #fff }
article { display: grid; grid-template-columns: minmax(0, 3fr) minmax(0, 2fr); gap: 1.2rem; margin: 1.6rem 0;
  border-top: 1px solid #bbb; padding-top: 1rem }
@media (max-width: 50rem) { article { grid-template-columns: minmax(0, 1fr) } }
img { width: 100%; height: auto; display: block }
.references img { width: 31%; display: inline-block; margin-top: .4rem }
h2 { font-size: 1.05rem; margin: 0 0 .5rem }
table { border-collapse: collapse; font-variant-numeric: tabular-nums }
td, th { padding: .15rem .9rem .15rem 0; text-align: left; font-weight: normal }
th { color: #555 }
.best { color: #06603a; font-weight: 600 }
.chosen { color: #9a1b1b; font-weight: 600 }
pre { white-space: pre-wrap; overflow-wrap: anywhere; background: #f3f3f3; padding: .6rem; max-height: 16rem;
  overflow: auto; font-size: .85rem }
@media (prefers-color-scheme: dark) {
  body { background: #161616; color: #e6e6e6 } pre { background: #242424 } th { color: #aaa }
  .best { color: #6fd3a4 } .chosen { color: #ff9a9a } article { border-color: #444 }
}
"""


@dataclass(frozen=True)
class Mistake:
    """An answer and what it costs: `lost` picks more than the best choice, `number` None for no valid answer."""

    row: Row
    reply: RecordedReply
    number: int | None
    lost: float


def worst_mistakes(rows: Sequence[Row], replies: Mapping[str, RecordedReply], most: int) -> list[Mistake]:
    """The answers that lose the most picks, the worst first; of equal ones those with a valid number first."""
    found = []
    for row in rows:
        reply = replies.get(str(row["id"]))
        if reply is not None:
            number = read_number(reply.text, list(row["numbers"]))
            scored = score_answer(row, number)
            if not scored.top1:
                found.append(Mistake(row, reply, number, scored.lost))
    found.sort(key=lambda m: (-m.lost, m.number is None, str(m.row["id"])))
    return found[:most]


def mistakes_page(title: str, mistakes: Sequence[Mistake]) -> str:
    """One HTML file that needs nothing else and runs no script; all that models and data say is escaped."""
    told = "The worst first." if mistakes else "There is none: every answer was one of the best choices."
    policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>\n<body><h1>{escape(title)}</h1>\n"
        f"<p>Numbers are picks to be expected until the target is out, this one included. {told}</p>\n"
        + "\n".join(_article(m) for m in mistakes)
        + "\n</body></html>\n"
    )


def _article(mistake: Mistake) -> str:
    row = mistake.row
    chose = "No valid choice" if mistake.number is None else f"Chose {mistake.number}"
    where = "out of sight" if row["target_hidden"] else "in sight as 0"
    references = "".join(_picture(picture, "the target alone") for picture in row["references"] or ())
    pictures = _picture(row["image"], "what the model saw") + (
        f'<div class="references">{references}</div>' if references else ""
    )
    return (
        f'<article id="{escape(str(row["id"]))}"><div>{pictures}</div><div>'
        f"<h2>{chose}: {mistake.lost:.2f} picks lost</h2>"
        f"<p>Target: {escape(str(row['description']))}, {where}. "
        f"Decision {escape(str(row['id']))}, reply {escape(mistake.reply.finish)}.</p>"
        f"{_values(row, mistake.number)}<pre>{escape(_shortened(mistake.reply.text)) or '(empty)'}</pre>"
        "</div></article>"
    )


def _values(row: Row, number: int | None) -> str:
    lines = []
    best = set(row["best"])
    for n, value, free in sorted(
        zip(row["numbers"], row["values"], row["graspable"]), key=lambda x: (x[1], x[0])
    ):
        mark = ' class="best"' if n in best else ' class="chosen"' if n == number else ""
        notes = ["best"] if n in best else []
        notes += ["chosen"] if n == number else []
        notes += [] if free else ["no grasp"]
        lines.append(f"<tr{mark}><td>{n}</td><td>{value:.2f}</td><td>{', '.join(notes)}</td></tr>")
    if number is None:
        lines.append(
            f'<tr class="chosen"><td>none</td><td>{row["random_value"]:.2f}</td><td>counts as random</td></tr>'
        )
    return f"<table><tr><th>object</th><th>expected picks</th><th></th></tr>{''.join(lines)}</table>"


def _picture(picture: bytes, what: str) -> str:
    return f'<img alt="{what}" src="{data_url(picture)}">'


def _shortened(text: str) -> str:
    """Its end, where the answer is; control characters would be no HTML."""
    plain = "".join(c if c.isprintable() or c in "\n\t" else "\ufffd" for c in text[-_LONGEST_REPLY:])
    return plain if len(text) <= _LONGEST_REPLY else "... " + plain
