"""Prices: as they are given, never made up."""

import pytest

from torc.episode.vlm_use import VlmUse
from torc.errors import InputError
from torc.records import Decision
from torc.vlm.price_files import FORMAT, parse_prices
from torc.vlm.prices import Prices

TABLE = f"format: {FORMAT}\ncurrency: EUR\nmodels:\n  gemini:m: {{sent: 0.3, written: 2}}\n"


def decision(*tokens):
    return Decision(None, "", evidence={"vlm": {"tries": [{"tokens": t} for t in tokens]}})


def used(prices, *decisions):
    use = VlmUse()
    for each in decisions:
        use.add(each)
    return use.facts(prices)


def test_prices_are_numbers_or_a_table(tmp_path):
    path = tmp_path / "prices.yaml"
    path.write_text(TABLE)
    assert parse_prices("0.3, 2", "any") == Prices(0.3, 2.0, "USD")
    assert parse_prices("0.3,2,EUR", "any") == Prices(0.3, 2.0, "EUR")
    assert parse_prices(str(path), "gemini:m") == Prices(0.3, 2.0, "EUR")
    assert parse_prices(str(path), "gemini:other") is None


@pytest.mark.parametrize("text", ["", "1", "1,2,3,4", "a,b", "-1,2", "1,nan", "1,2,U$D"])
def test_what_is_no_price_is_refused(text):
    with pytest.raises(InputError, match=r"price|currency"):
        parse_prices(text, "m")


@pytest.mark.parametrize("change", [("0.3", "-1"), ("sent", "sold"), (FORMAT, "other/1"), ("EUR", "E U")])
def test_a_table_that_is_none_says_why(tmp_path, change):
    path = tmp_path / "prices.yaml"
    path.write_text(TABLE.replace(*change))
    with pytest.raises(InputError, match=r"price table|currency"):
        parse_prices(str(path), "gemini:m")
    with pytest.raises(InputError, match="cannot be read"):
        parse_prices(str(tmp_path / "none.yaml"), "gemini:m")


def test_sums_are_over_all_calls_of_all_picks():
    one = {"prompt": 1000, "reply": 100, "thinking": None}
    facts = used(Prices(1.0, 20.0), decision(one, one), decision(one), decision())
    assert facts["calls"] == 3
    assert (facts["tokens_sent"], facts["tokens_written"], facts["tokens_thinking"]) == (3000, 300, None)
    assert facts["cost"] == pytest.approx(0.009)


def test_a_call_that_tells_no_tokens_leaves_no_sum_that_is_too_small():
    one, dumb = {"prompt": 1000, "reply": 100, "thinking": 0}, {"prompt": 1000, "reply": None}
    facts = used(Prices(1.0, 20.0), decision(one), decision(dumb))
    assert (facts["tokens_sent"], facts["tokens_written"], facts["cost"]) == (2000, None, None)
    assert used(None, decision(one))["cost"] is None


@pytest.mark.parametrize("evidence", [{}, {"vlm": 3}, {"vlm": {"tries": "no"}}, {"vlm": {"tries": [3]}}])
def test_evidence_of_somebody_s_planner_breaks_nothing(evidence):
    assert used(Prices(1, 1), Decision(None, "", evidence=evidence))["calls"] == 0
