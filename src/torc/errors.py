"""The errors of torc. Expected failures are values (see `PlanFailure`); these are for everything else.

Every message names the fault, its place, and what the user can do about it.
"""


class TorcError(Exception):
    """Root of all errors raised on purpose. The command line prints its text and exits, without a traceback."""


class InputError(TorcError):
    """A file, argument or image from outside cannot be used. Exit code 2 on the command line."""


class UnknownNameError(InputError):
    """A name that is not in a registry. The message names the nearest one, and lists all valid or all near ones."""

    MANY = 60
    FEW = 5

    def __init__(self, what: str, name: str, valid: list[str], more: str = "", lister: str = "") -> None:
        """Make the message from the kind of thing (`what`), the unknown name, and the valid ones.

        `more` follows the valid names; `lister` is a command that lists them, so that the message lists only a few.
        """
        import difflib
        import re

        def plain(text: str) -> str:
            """Drop leading zeros of numbers: "structured-01" becomes "structured-1"."""
            return re.sub(r"0+(?=\d)", "", text)

        same = [v for v in valid if plain(v) == plain(name)]
        near = same or difflib.get_close_matches(name, valid, n=6, cutoff=0.5)
        hinted = bool(near and difflib.get_close_matches(name, near[:1]))
        hint = f" Did you mean '{near[0]}'?" if hinted else ""
        if lister:
            some = "" if hinted else f"Known: {', '.join(valid[: self.FEW])}, ... "
            known = f"{some}`{lister}` lists all {len(valid)}"
        elif len(valid) <= self.MANY:
            known = f"Known: {', '.join(sorted(valid))}"
        else:
            others = f"among them {', '.join(near)}" if near else "none of them like it"
            known = f"There are {len(valid)}, {others}"
        super().__init__(f"Unknown {what} '{name}'.{hint} {known}{more}.")
        self.name = name


class MissingDependencyError(TorcError):
    """An optional library or system package is not installed; the message holds the exact line that installs it."""

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(f"{what} is not available. Install it with: {remedy}")


def extra_remedy(extra: str) -> str:
    """Return how to get an optional extra. (`torc` on the package index is an unrelated project.)"""
    return f"scripts/setup {extra} (in torc's checkout) or pip install 'torc-retrieval[{extra}]'"


class PlannerError(TorcError):
    """A task planner, mostly a third party's, crashed or returned something that is not a decision."""


class VlmClientError(TorcError):
    """A VLM client, mostly a third party's, crashed or returned something that is not a reply."""


class PartError(TorcError):
    """A camera, depth, perception or motion planner, mostly a third party's, crashed or returned something unusable."""


class CameraError(TorcError):
    """A camera cannot be opened, is gone, or gives pictures that cannot be used; the message names the remedy."""


class GraspPlannerError(TorcError):
    """A grasp planner, mostly a third party's, crashed or returned something that is not a set of grasps."""


class NetworkError(TorcError):
    """The server of a network is absent, slow or broken, or its answer cannot be used; never a failed pick.

    Attributes:
        address: of the server.
        action: the request.
    """

    def __init__(self, address: str, action: str, why: str, remedy: str) -> None:
        super().__init__(f"The server {address} gave no usable answer to '{action}': {why} {remedy}")
        self.address, self.action = address, action


class PickHaltedError(TorcError):
    """A robot was stopped within a pick, by itself, by torc or by a person.

    The pick has no result; the episode can continue once a person has checked the robot.
    """


class PhysicsError(TorcError):
    """The simulation broke (a body too fast, a deep penetration, NaN). The trial is errored, never scored."""
