"""How a model is named and asked."""

import pytest

from torc.errors import InputError
from torc.vlm.config import VlmConfig, parse_vlm


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("gemini:gemini-robotics-er-2-preview", ("gemini", "gemini-robotics-er-2-preview", None)),
        ("openai:qwen2.5-vl@http://localhost:8000/v1", ("openai", "qwen2.5-vl", "http://localhost:8000/v1")),
        ("openai:hub/model:4b@q8@https://h/v1", ("openai", "hub/model:4b@q8", "https://h/v1")),
        ("mine.clients:Mine", ("mine.clients:Mine", "", None)),
        ("mine:Mine:big@q8", ("mine:Mine", "big@q8", None)),
        ("mine:Mine:big@https://h/v1", ("mine:Mine", "big", "https://h/v1")),
        ("mine:Mine@http://localhost:8000", ("mine:Mine", "", "http://localhost:8000")),
        ("simulated", ("simulated", "paper", None)),
        ("simulated:0.8", ("simulated", "0.8", None)),
    ],
)
def test_a_model_is_named_in_one_word(text, parts):
    assert parse_vlm(text) == parts
    assert VlmConfig(*parts).text == (text if text != "simulated" else "simulated:paper")


@pytest.mark.parametrize(
    ("text", "remedy"),
    [
        ("openai:m@localhost:8000", "Write openai:m@http://localhost:8000,"),
        ("gemini:m@", "Write gemini:m@http://localhost:8000/v1,"),
    ],
)
def test_an_address_without_its_scheme_is_never_a_vendors_model(text, remedy):
    with pytest.raises(InputError, match="http:// or https://") as refused:
        parse_vlm(text)
    assert remedy in str(refused.value)


@pytest.mark.parametrize("text", ["", "gemini", "gemini:", ":model"])
def test_half_a_name_says_how_to_write_one(text):
    with pytest.raises(InputError, match=r"gemini:MODEL|Unknown VLM provider"):
        VlmConfig(*parse_vlm(text))


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"model": "a b"}, "no model name"),
        ({"base_url": "localhost:8000"}, "no address"),
        ({"base_url": "ftp://host/"}, "no address"),
        ({"temperature": 3.0}, "temperature"),
        ({"thinking": "hard"}, "off, minimal"),
        ({"thinking": True}, "off, minimal"),
        ({"thinking": 100}, "in words"),
        ({"max_output_tokens": 0}, "max_output_tokens"),
        ({"timeout_s": 0.0}, "time-out"),
        ({"retries": -1}, "retries"),
    ],
)
def test_bad_options_are_refused(options, text):
    with pytest.raises(InputError, match=text):
        VlmConfig(**{"provider": "openai", "model": "m", **options})


@pytest.mark.parametrize(
    "url", ["http://me:secret-1@host/v1", "https://host/v1?key=secret-1", "http://host/#secret-1"]
)
def test_an_address_with_a_secret_is_refused_without_repeating_it(url):
    with pytest.raises(InputError, match="TORC_VLM_API_KEY") as caught:
        VlmConfig("openai", "m", url)
    assert "secret-1" not in str(caught.value)
