"""Prices from the command line, or from a table in a file.

format: torc-vlm-prices/1
currency: USD
models:
  gemini:MODEL: {sent: 0.3, written: 2.5}      # of a million tokens
"""

from pathlib import Path
from typing import Literal

from pydantic import BaseModel, Field

from torc.errors import InputError
from torc.io.strict_yaml import read_yaml_as
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
    if text.endswith((".yaml", ".yml")):
        table = read_yaml_as(_PriceFile, Path(text), "vlm-prices", _MAX_BYTES, _REMEDY)
        entry = table.models.get(model)
        return None if entry is None else Prices(entry.sent, entry.written, table.currency)
    try:
        sent, written, *currency = (part.strip() for part in text.split(","))
        return Prices(float(sent), float(written), *currency)
    except (ValueError, TypeError):
        raise InputError(
            f"'{text}' names no prices: write those of a million tokens sent and written, e.g. 0.30,2.50 or "
            "0.30,2.50,EUR, or a price table that ends in .yaml."
        ) from None
