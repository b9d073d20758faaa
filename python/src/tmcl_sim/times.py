"""Times as the control port reads them. In Python they are seconds of virtual time."""

import math


def span(seconds: float) -> str:
    """A time of the control port, in microseconds. Raises ValueError for one that is no number."""
    if not math.isfinite(seconds):
        raise ValueError(f"a time is a number of seconds, not {seconds}")
    return f"{round(seconds * 1e6)} us"


def seconds(answer: dict[str, int]) -> float:
    """The virtual time of an answer."""
    return answer["time_us"] / 1e6
