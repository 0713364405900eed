"""Every public name is documented like a page of a manual, and the page is up to date."""

import inspect
import re
from dataclasses import fields, is_dataclass
from enum import Enum

import pytest

import torc
from tools import api_page
from torc import protocols


def listed(doc):
    return {n.strip() for m in re.finditer(r"^    ([\w, ]+): ", doc or "", re.M) for n in m[1].split(",")}


def test_the_page_is_what_the_docstrings_say():
    assert api_page.PAGE.read_text() == api_page.page(), "run python -m tools.api_page"


def test_the_page_has_every_public_name_once():
    assert sorted(name for names in api_page.CHAPTERS.values() for name in names) == torc.__all__


@pytest.mark.parametrize("name", torc.__all__)
def test_a_public_name_documents_everything_that_it_takes(name):
    what = getattr(torc, name)
    doc = inspect.getdoc(what) or ""
    assert re.match(r"[A-Z][^\n]*\.", doc), "a whole sentence on the first line"
    if is_dataclass(what):
        assert {f.name for f in fields(what)} <= listed(doc) | set(api_page.field_docs(what))
    elif inspect.isfunction(what):
        assert set(inspect.signature(what).parameters) <= listed(doc)
        assert "Raises:" in doc
    elif not issubclass(what, Enum | Exception):
        assert set(inspect.signature(what).parameters) <= listed(inspect.getdoc(what.__init__))


def test_names_for_part_writers_are_there():
    assert all(getattr(protocols, name) is not None for name in protocols.__all__)
