"""The pytest plugin: the fixture `virtual_module`, its marker and options, and what the report of a failing test tells.

It is loaded by its entry point wherever the package is installed. A test that does not ask for the fixture is left
alone.
"""

from __future__ import annotations

import difflib
import inspect
import re
from collections.abc import Generator, Iterator
from pathlib import Path
from typing import Any

import pytest
from _pytest._code.code import ExceptionRepr

from .sim import Sim, open_sims
from .witness import Section, Witness, sections

# The arguments of the marker that are paths, and the option for images.
PATHS = ("world", "image", "eeprom", "log")
IMAGE_OPTION, PLOTS_OPTION = "--tmcl-sim-image", "--tmcl-sim-plots"

if not hasattr(pytest, "StashKey"):
    raise pytest.UsageError(
        f"the plugin of tmcl-sim needs pytest 7 or later, and this is {pytest.__version__}: "
        "`pip install -U pytest` brings it, and `pytest -p no:tmcl_sim` goes without the plugin"
    )

WITNESS = pytest.StashKey[Witness]()
IMAGE = pytest.StashKey[tuple[str, str]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Adds the options."""
    group = parser.getgroup("tmcl-sim", "virtual TMCM modules")
    group.addoption(
        IMAGE_OPTION,
        metavar="ELF",
        help="run this flash image in the modules of tests whose marker names no image of its own; tests for another "
        "product or firmware are skipped",
    )
    group.addoption(
        PLOTS_OPTION,
        metavar="DIR",
        help="put the plots of failing tests into DIR, which is made if there is none; without it they are in a folder "
        "for temporary files",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Tells pytest of the marker."""
    config.addinivalue_line(
        "markers",
        "tmcl_sim(world=None, **arguments): the arguments of tmcl_sim.Sim for the fixture virtual_module, such as "
        'world="stage.toml" or product="6110"; paths are relative to the file of the test, and of several markers the '
        "nearer one wins, argument by argument",
    )


@pytest.fixture
def virtual_module(request: pytest.FixtureRequest) -> Iterator[Sim]:
    """A fresh virtual module: a tmcl_sim.Sim, paused if the marker does not say otherwise."""
    arguments = _arguments(request.node)
    _take_image(request, arguments)
    with Sim(**arguments) as sim:
        request.node.stash[WITNESS] = witness = Witness(sim)
        try:
            yield sim
        finally:
            witness.end()


@pytest.fixture
def tmcl_sim(virtual_module: Sim) -> Sim:
    """The same as virtual_module, under a name that hides the module tmcl_sim in a test."""
    return virtual_module


def _arguments(node: pytest.Item) -> dict[str, Any]:
    """The arguments for the Sim of a test, from its markers."""
    arguments: dict[str, Any] = {}
    known = list(inspect.signature(Sim).parameters)
    for marker in reversed(list(node.iter_markers("tmcl_sim"))):
        if len(marker.args) > 1:
            pytest.fail(f"{_written(marker)}: only the world can stand without a name", pytrace=False)
        given = {**dict(zip(known, marker.args, strict=False)), **marker.kwargs}
        for name in given.keys() - known:
            close = difflib.get_close_matches(name, known, 1)
            hint = f"did you mean '{close[0]}'?" if close else f"there are: {', '.join(known)}"
            pytest.fail(f"{_written(marker)}: there is no argument '{name}'; {hint}", pytrace=False)
        arguments |= given
    for name in PATHS:
        if arguments.get(name) is not None:
            arguments[name] = node.path.parent / arguments[name]
    return arguments


def _written(marker: pytest.Mark) -> str:
    """A marker as it is written in a test."""
    values = [repr(value) for value in marker.args] + [f"{name}={value!r}" for name, value in marker.kwargs.items()]
    return f"@pytest.mark.tmcl_sim({', '.join(values)})"


def _take_image(request: pytest.FixtureRequest, arguments: dict[str, Any]) -> None:
    """Adds the image of the option to the arguments of a test that names none, or skips the test if it is not for
    it."""
    config = request.config
    given = config.getoption(IMAGE_OPTION)
    if given is None or "image" in arguments:
        return
    image = config.invocation_params.dir / given
    if IMAGE not in config.stash:
        with Sim(image=image) as sim:
            config.stash[IMAGE] = sim.product, sim.ready["firmware"]
    product, firmware = config.stash[IMAGE]
    wanted = arguments.get("product") or product
    products = [wanted] if isinstance(wanted, str) else wanted
    others = [name for name in products if name.removeprefix("TMCM-") != product.removeprefix("TMCM-")]
    if others or arguments.get("firmware", firmware) != firmware:
        pytest.skip(f"{IMAGE_OPTION}: the image is for the {product} with the firmware {firmware}, this test is not")
    arguments["image"] = image


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo[None]) -> Generator[None, Any, None]:
    """Adds sections to the report of a test, or of its fixtures, that has failed."""
    outcome = yield
    report: pytest.TestReport = outcome.get_result()
    if report.failed:
        # Whatever goes wrong here, the failure of the test is to be told.
        try:
            _tell(item, report)
        except Exception as error:
            _add(report, "tmcl_sim", f"No more can be told: {error!r}")
    if call.when == "teardown" and WITNESS in item.stash:
        del item.stash[WITNESS]


def _tell(item: pytest.Item, report: pytest.TestReport) -> None:
    """Adds the sections to a report: of the simulator of the fixture, and of others that are open."""
    witness = item.stash.get(WITNESS, None)
    if witness:
        for section in witness.sections(item.nodeid):
            text = section.text
            if section.image:
                text += f"\n\n{_keep(item, section)}"
                _show(item.config, report, section.image)
            _add(report, f"tmcl_sim: {section.title}", text)
    for sim in open_sims():
        if witness is None or sim is not witness.sim:
            for section in sections(sim, of=f" of the Sim at {sim.tcp}"):
                _add(report, f"tmcl_sim: {section.title}", section.text)


def _add(report: pytest.TestReport, title: str, text: str) -> None:
    """Adds a section. What follows the traceback is in reports of JUnit as well; sections of the report are not."""
    if isinstance(report.longrepr, ExceptionRepr):
        report.longrepr.addsection(title, text)
    else:
        report.sections.append((title, text))


def _keep(item: pytest.Item, section: Section) -> str:
    """Writes the image of a section to a file, and says where it is."""
    assert section.image
    try:
        path = _folder(item.config) / (re.sub(r"[^\w.-]+", "_", f"{item.nodeid} {section.title}") + ".svg")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(section.image, encoding="utf-8")
    except OSError as error:
        return f"The plot cannot be written: {error}"
    return f"As an image: {path}"


def _folder(config: pytest.Config) -> Path:
    """Where plots go."""
    if named := config.getoption(PLOTS_OPTION):
        return config.invocation_params.dir / str(named)
    factory: pytest.TempPathFactory | None = getattr(config, "_tmp_path_factory", None)
    if factory is None:
        raise OSError(f"pytest runs without its plugin tmpdir, so name a folder: {PLOTS_OPTION}=DIR")
    return factory.getbasetemp() / "tmcl-sim-plots"


def _show(config: pytest.Config, report: pytest.TestReport, image: str) -> None:
    """Shows an image in the report of pytest-html, if there is one."""
    if config.pluginmanager.hasplugin("html"):
        from pytest_html import extras

        vars(report).setdefault("extras", []).append(extras.html(image))
