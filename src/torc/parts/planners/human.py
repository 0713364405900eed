"""A person at a page in the browser; `torc human` opens it."""

from torc.web.expert import HumanPlanner as PART
