"""Prices: as they are given, never made up."""

import pytest

from torc.errors import InputError
from torc.records.evidence import ModelTry, Tokens
from torc.trials.vlm_use import vlm_use
from torc.vlm.price_files import FORMAT, parse_prices
from torc.vlm.prices import Prices

TABLE = f"format: {FORMAT}\ncurrency: EUR\nmodels:\n  gemini:m: {{sent: 0.3, written: 2}}\n"


def used(prices, *tokens):
    return vlm_use([ModelTry(tokens=t) for t in tokens], prices)


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
    with pytest.raises(InputError, match=r"vlm-prices|currency"):
        parse_prices(str(path), "gemini:m")
    with pytest.raises(InputError, match="Cannot read"):
        parse_prices(str(tmp_path / "none.yaml"), "gemini:m")


def test_sums_are_over_all_requests():
    one = Tokens(prompt=1000, reply=100)
    use = used(Prices(1.0, 20.0), one, one, one)
    assert use.calls == 3
    assert (use.tokens_sent, use.tokens_written, use.tokens_thinking) == (3000, 300, None)
    assert use.cost == pytest.approx(0.009)


def test_a_request_of_unknown_size_leaves_no_sum_that_is_too_small():
    one = Tokens(prompt=1000, reply=100, thinking=0)
    use = used(Prices(1.0, 20.0), one, Tokens(prompt=1000))
    assert (use.tokens_sent, use.tokens_written, use.cost) == (2000, None, None)
    assert used(None, one).cost is None
