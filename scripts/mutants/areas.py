"""The areas whose tests are put to the test: their files, and the tests that are likely to notice first."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Area:
    """Some files of one crate or package."""

    crate: str
    """The folder with the crate's `src`; `.` is the firmware."""
    files: tuple[str, ...]
    """Patterns below that folder; those that begin with `!` take away."""
    first: tuple[str, ...]
    """The tests that are run first, by the name of their file or of their binary; all others come after them."""
    packages: tuple[str, ...] = ("tmcm",)
    """The packages whose tests are run: those that are to notice. Tests of the tools would notice more, and much later."""


AREAS = {
    "motion": Area(".", ("src/motion/*.rs", "src/motion/tmc429/*.rs", "!src/motion/tmc5160.rs"), ("motion", "tmcm", "module", "tmcm3212")),
    "tmc5160": Area(".", ("src/motion/tmc5160.rs", "src/motion/tmc5160/*.rs"), ("motion", "tmcm3212")),
    "store": Area(".", ("src/store/*.rs",), ("tmcm", "store")),
    "vm": Area(".", ("src/vm/*.rs",), ("program", "tmcm")),
    "device": Area(".", ("src/device/*.rs",), ("module", "motion", "several_axes", "tmcm", "canopen")),
    "drive": Area(".", ("src/canopen/drive/*.rs",), ("canopen", "tmcm")),
    "tune": Area("tools", ("src/tune/*.rs",), ("tmcl_tools", "program"), ("tmcl-tools", "tmcl-cli")),
    "python": Area("python", ("src/**/*.py",), ("test_sim", "test_module", "test_time", "test_plugin")),
}

# Their images do not come from the changed sources, and these look at the sources as text.
NOT_RUN = {"image", "layers", "panic_free"}
