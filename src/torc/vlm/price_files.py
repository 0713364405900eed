"""Prices from the command line, or from a table in a file.

format: torc-vlm-prices/1
currency: USD
models:
  gemini:MODEL: {sent: 0.3, written: 2.5}      # of a million tokens
"""

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, Field, ValidationError

from torc.errors import InputError
from torc.io.reading import read_text
from torc.io.strict_yaml import explain_faults, parse_plain_yaml
from torc.vlm.prices import Prices

FORMAT = "torc-vlm-prices/1"
_MAX_BYTES = 100_000
_REMEDY = "docs/vlm.md shows one (Tokens and cost)."


class _Entry(BaseModel, extra="forbid", allow_inf_nan=False):
    sent: float = Field(ge=0)
    written: float = Field(ge=0)


class _PriceFile(BaseModel, extra="forbid"):
    format: Literal["torc-vlm-prices/1"]
    currency: str
    models: dict[str, _Entry]


def parse_prices(text: str, model: str) -> Prices | None:
    """Read a model's prices from "SENT,WRITTEN" or "SENT,WRITTEN,CURRENCY", or from a price table.

    `model` is written as on the command line. None if the table lacks the model. Raises InputError.
    """
    if not text.endswith((".yaml", ".yml")):
        return _from_numbers(text)
    try:
        content = parse_plain_yaml(
            read_text(Path(text), "replace"),
            text,
            "vlm-prices",
            _MAX_BYTES,
            _REMEDY,
        )
        found = _PriceFile.model_validate(content)
    except OSError as error:
        raise InputError(f"The price table '{text}' cannot be read: {error.strerror}.") from None
    except ValidationError as error:
        raise InputError(f"{text} is no price table. {_REMEDY}\n{explain_faults(error)}") from None
    entry = found.models.get(model)
    return None if entry is None else Prices(entry.sent, entry.written, found.currency)


def _from_numbers(text: str) -> Prices:
    parts = [part.strip() for part in text.split(",")]
    try:
        sent, written, *currency = parts
        return Prices(float(sent), float(written), *currency)
    except (ValueError, TypeError):
        raise InputError(
            f"'{text}' names no prices: write those of a million tokens sent and written, e.g. 0.30,2.50 or "
            "0.30,2.50,EUR, or a price table that ends in .yaml."
        ) from None
