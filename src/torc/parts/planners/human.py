"""A person at a page in the browser; `torc human` opens it."""

from torc.web.session import HumanPlanner as PART
