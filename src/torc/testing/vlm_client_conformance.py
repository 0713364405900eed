"""What every VLM client must do, whatever it asks and however, as checks that the author of one runs on it.

    import pytest
    from torc.testing.vlm_client_conformance import CASES, check_case

    @pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
    def test_my_client_conforms(case):
        check_case(MyClient, case)

or all at once: `check_client(MyClient)`. Both raise NonConformanceError, which lists what was broken. The questions are
those that the shipped planners ask, so a client of a live model needs that model, or a stand-in for it. Clients of
servers that speak a vendor's protocol have a suite with fake servers besides: `torc.testing.vlm_conformance`.
"""

import pickle
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from torc.errors import TorcError
from torc.testing.conformance import NonConformanceError
from torc.testing.vlm_conformance import sample_png
from torc.vlm.answers import PLAN_SCHEMA, RELATIONS_SCHEMA
from torc.vlm.failures import VlmError
from torc.vlm.json_text import find_json
from torc.vlm.prompt_files import fill_prompt
from torc.vlm.protocol import Question, Reply, VlmClient
from torc.vlm.replies import reply_faults

ClientFactory = Callable[[], VlmClient]
_FACTS = "Object 1 is graspable.\nObject 3 is blocked by object 1."
_RELATIONS = '[\n  {"source": 3, "relation": "behind", "target": 1}\n]'
_HIDDEN = "It is not in sight: nothing in the picture carries the number 0."


@dataclass(frozen=True)
class Case:
    """A question.

    Attributes:
        name: for reports.
        question: what is asked.
    """

    name: str
    question: Question


def _case(name: str, prompt: str, state: str = "It is in sight.", **values: object) -> Case:
    schema = RELATIONS_SCHEMA if "relations" in values else PLAN_SCHEMA
    text = fill_prompt(prompt, target=0, target_state=state, **values)
    return Case(name, Question(text, (sample_png(),), schema, repeat=3))


CASES: tuple[Case, ...] = (
    _case("the plan of VLM-SELECT", "vlm-select-1"),
    _case("the same, target hidden", "vlm-select-1", _HIDDEN),
    _case("the plan of VLM+GRASPS", "vlm-grasps-1", facts=_FACTS),
    _case("the relations of VLM-FIXES-DG", "vlm-fixes-dg-1", relations=_RELATIONS),
)


def check_client(make: ClientFactory, cases: tuple[Case, ...] = CASES) -> None:
    """Runs all cases with fresh clients. Raises NonConformanceError with everything that was broken."""
    broken = [text for case in cases for text in violations(make, case)]
    if broken:
        raise NonConformanceError("This client does not conform:\n- " + "\n- ".join(dict.fromkeys(broken)))


def check_case(make: ClientFactory, case: Case) -> None:
    """Runs one case. Raises NonConformanceError with everything that was broken."""
    check_client(make, (case,))


def violations(make: ClientFactory, case: Case) -> list[str]:
    """The rules that a client breaks in one case; empty if none.

    A model that cannot be asked is no violation, if the client says so with a VlmError.
    """
    before, drawn = pickle.dumps(case.question), str(np.random.get_state())
    found: list[str] = []
    try:
        client = make()
        if not isinstance(client, VlmClient):
            return [f"{case.name}: it has no method `ask(question)`"]
        # Twice: a client is asked many times, and one that was closed by its first answer is of no use.
        found = [fault for _ in range(2) for fault in _faults(client.ask(case.question))]
    except VlmError:
        pass
    except TorcError as error:
        found.append(f"it raised {type(error).__name__}, not torc.vlm.failures.VlmError: {error}")
    except (Exception, SystemExit) as error:  # whatever a stranger's client raises is the finding
        found.append(
            f"it raised {type(error).__name__}: {error}; a model that gives no reply is a torc.vlm.failures.VlmError"
        )
    if pickle.dumps(case.question) != before:
        found.append("it changed the question")
    if str(np.random.get_state()) != drawn:
        found.append("it drew from numpy's global random generator; question.repeat is the seed")
    return [f"{case.name}: {text}" for text in dict.fromkeys(found)]


def _faults(reply: Reply) -> list[str]:
    faults = list(reply_faults(reply))
    if not faults and reply.answer != find_json(reply.text):
        faults.append("answer is not what stands in text; make replies with torc.vlm.replies.reply_of")
    if not faults and not reply.model_version.strip():
        faults.append("model_version is empty; say who answered")
    return faults
