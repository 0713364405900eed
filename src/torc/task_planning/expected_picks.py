"""What a grasp that may fail, and may lose its object, costs in picks."""


def expected_picks(p: float, lost_share: float, picks_left: int) -> float:
    """Expected number of picks to get an object out by a grasp that succeeds with probability p; infinite for p = 0.

    With q the share of failed tries that lose the object, and with it all picks that are left:

        cost(p) = tries + lost * picks_left,  tries = 1 / (p + q (1 - p)),  lost = q (1 - p) * tries
    """
    return picks_until(p, lost_share * (1 - p), picks_left) if p > 0 else float("inf")


def picks_until(comes: float, goes: float, picks_left: int) -> float:
    """The same where a try gets the object with one probability and loses it with another; one of them is above 0."""
    return float((1 + goes * picks_left) / (comes + goes))
