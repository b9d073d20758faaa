"""Times as the control port reads them. In Python they are seconds of virtual time."""


def span(seconds: float) -> str:
    """A time of the control port, in microseconds."""
    return f"{round(seconds * 1e6)} us"


def seconds(answer: dict[str, int]) -> float:
    """The virtual time of an answer."""
    return answer["time_us"] / 1e6
