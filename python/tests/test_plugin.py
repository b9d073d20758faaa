"""The pytest plugin, in a pytest of its own: what it gives to tests, and what the report of a failing test tells."""

from __future__ import annotations

import threading
from pathlib import Path
from xml.etree import ElementTree

import pytest

FAILING = """
import pytest

@pytest.mark.tmcl_sim(product="3110")
def test_moves(virtual_module):
    virtual_module.send("MVP ABS, 0, 51200")
    virtual_module.send("MVP ABS, 2, -1000")
    virtual_module.run_until("rotor = 51200", max=1.0)
"""
# What its report tells.
SECTIONS = [
    "*test_failing.py:*: NotMet",
    "*- tmcl_sim: last telegrams -*",
    "*control  >  01 04 00 00 00 00 C8 00 CD   to 1: MVP ABS, 0, 51200",
    "*control  <  02 01 64 04 00 00 C8 00 33   from 1: 51200 microsteps (target), status 100 ok",
    "*- tmcl_sim: state of module 1, TMCM-3110 -*",
    "time            paused",
    "temperature     25",
    "                axis 0          axis 1          axis 2",
    "velocity        1000            0               0",
    "switches        none pressed    none pressed    none pressed",
    "*- tmcl_sim: motion of module 1, TMCM-3110 -*",
    "axis 0: position in microsteps",
    "29 511 |  *  [*][*][*][*][*]",
    "    22 |[*][*][*][*][*][*]",
    "       +----------------------------------------------------------------",
    "        0.072 s   *   1.062 s",
    "axis 1: position in microsteps: 0 all the time",
    "axis 0: speed in internal units",
    "1 000 |    [*][*][*]*",
    "As an image: *tmcl-sim-plots/test_failing.py_test_moves_motion_of_module_1_TMCM-3110.svg",
]


def traces() -> list[str]:
    """Threads of the plugin, and simulators, that are left in this process."""
    threads = [thread.name for thread in threading.enumerate() if thread.name.startswith("tmcl_sim")]
    children = Path(f"/proc/self/task/{threading.get_native_id()}/children").read_text().split()
    return threads + [child for child in children if Path(f"/proc/{child}/comm").read_text() == "tmcl\n"]


def plots(pytester: pytest.Pytester) -> list[Path]:
    return sorted(pytester.path.rglob("*.svg"))


def labels(image: ElementTree.Element) -> set[str | None]:
    """What is written in a plot."""
    return {text.text for text in image.iter("{http://www.w3.org/2000/svg}text")}


def test_a_failing_test_is_told_all(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_failing=FAILING)
    result = pytester.runpytest("--basetemp=temporary")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(SECTIONS)
    (plot,) = plots(pytester)
    image = ElementTree.parse(plot).getroot()
    assert image.tag.endswith("svg")
    assert {"position in microsteps", "speed in internal units", "virtual time in seconds", "axis 2"} <= labels(image)


def test_workers_report_as_well(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_failing=FAILING, test_passing=FAILING.replace("1.0)", "9.0)"))
    result = pytester.runpytest_subprocess("-n2", "--tmcl-sim-plots=plots")
    result.assert_outcomes(failed=1, passed=1)
    result.stdout.fnmatch_lines(
        ["*- tmcl_sim: last telegrams -*", "*- tmcl_sim: state of *", "*- tmcl_sim: motion of *"]
    )
    assert [plot.parent for plot in plots(pytester)] == [pytester.path / "plots"]


def test_a_passing_test_leaves_nothing(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("def test_it(virtual_module): virtual_module.step(1.0)\ndef test_without(): pass")
    result = pytester.runpytest_inprocess("--tmcl-sim-plots=plots")
    result.assert_outcomes(passed=2)
    assert not (pytester.path / "plots").exists()
    result.stdout.no_fnmatch_line("*tmcl_sim:*")
    assert traces() == []


def test_a_failing_test_leaves_its_plot_alone(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_failing=FAILING)
    pytester.runpytest_inprocess("--tmcl-sim-plots=plots").assert_outcomes(failed=1)
    assert len(list((pytester.path / "plots").iterdir())) == 1
    assert traces() == []


def test_html_reports_show_the_plot(pytester: pytest.Pytester) -> None:
    pytest.importorskip("pytest_html")
    pytester.makepyfile(test_failing=FAILING)
    pytester.runpytest("--html=report.html", "--self-contained-html").assert_outcomes(failed=1)
    assert "polyline" in (pytester.path / "report.html").read_text()


def test_a_fixture_that_fails_is_told_all(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.fixture
        def stage(virtual_module):
            virtual_module.send("SAP 4, 0, 5000")

        def test_it(stage): pass
        """
    )
    result = pytester.runpytest()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(
        [
            "E *Refused: SAP 4, 0, 5000: status 4 *",
            "*- tmcl_sim: last telegrams -*",
            "no plot: a sample *, and there has been none",
        ]
    )
    assert plots(pytester) == []


def test_a_teardown_that_fails_is_told_all(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.fixture
        def stage(virtual_module):
            yield
            virtual_module.send("MVP ABS, 0, 51200")
            virtual_module.step(0.1)
            virtual_module.send("SAP 4, 0, 5000")

        def test_it(stage): pass
        """
    )
    result = pytester.runpytest()
    result.assert_outcomes(passed=1, errors=1)
    result.stdout.fnmatch_lines(
        [
            "E *Refused: SAP 4, 0, 5000: status 4 *",
            "*- tmcl_sim: last telegrams -*",
            "*to 1: MVP ABS, 0, 51200",
            "*- tmcl_sim: state of module 1, TMCM-1140 -*",
            "*- tmcl_sim: motion of module 1, TMCM-1140 -*",
            "axis 0: position in microsteps",
        ]
    )


def test_junit_tells_all(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_failing=FAILING)
    pytester.runpytest("--junitxml=junit.xml").assert_outcomes(failed=1)
    (failure,) = ElementTree.parse(pytester.path / "junit.xml").getroot().iter("failure")
    told = failure.text or ""
    assert "tmcl_sim: last telegrams" in told
    assert "status 100 ok" in told
    assert "As an image: " in told


def test_other_simulators_are_told(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest, tmcl_sim

        @pytest.fixture(scope="module")
        def station():
            with tmcl_sim.Sim(product="6110") as sim:
                yield sim

        def test_it(station):
            station.send("MVP ABS, 5, 100")
            assert False

        def test_both(station, virtual_module): assert False
        """
    )
    result = pytester.runpytest()
    result.assert_outcomes(failed=2)
    others = [
        "*- tmcl_sim: last telegrams of the Sim at 127.0.0.1:* -*",
        "*to 1: MVP ABS, 5, 100",
        "*- tmcl_sim: state of module 1, TMCM-6110 of the Sim at 127.0.0.1:* -*",
        "position        0               0               0 *",
    ]
    result.stdout.fnmatch_lines([*others, "*- tmcl_sim: motion of module 1, TMCM-1140 -*", *others])


def test_missing_samples_are_told(pytester: pytest.Pytester) -> None:
    pytester.makeconftest("import tmcl_sim.recorder\ntmcl_sim.recorder.Recorder.missed = 7")
    pytester.makepyfile(test_failing=FAILING)
    result = pytester.runpytest_subprocess()
    result.stdout.fnmatch_lines(["7 samples are missing: the computer was too busy to read them"])


def test_a_simulator_that_has_died_is_told(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import os

        def test_it(virtual_module):
            virtual_module.send("GAP 6, 0")
            os.kill(virtual_module.ready["pid"], 9)
            virtual_module.send("GAP 6, 0")
        """
    )
    result = pytester.runpytest()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            "E *Died: the simulator has ended with signal SIGKILL without a word",
            "*to 1: GAP 6, 0",
            "*- tmcl_sim: state of *",
            "the simulator has ended with signal SIGKILL without a word",
            "*- tmcl_sim: motion of *",
        ]
    )
    # The frames of the package are not in the traceback.
    result.stdout.no_fnmatch_line("*tmcl_sim/*.py:*")


def test_a_simulator_that_was_closed_is_told(pytester: pytest.Pytester) -> None:
    pytester.makepyfile("def test_it(virtual_module):\n    virtual_module.close()\n    assert False")
    result = pytester.runpytest()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*- tmcl_sim: last telegrams -*", "this Sim is closed"])


def test_a_restart_begins_the_plot_anew(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        def test_it(virtual_module):
            virtual_module.send("MVP ABS, 0, 51200")
            virtual_module.step(5.0)
            virtual_module.restart()
            virtual_module.step(1.0)
            assert False
        """
    )
    result = pytester.runpytest()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["axis 0: position in microsteps: 0 all the time"])


def test_the_nearer_marker_wins_by_argument(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest

        pytestmark = pytest.mark.tmcl_sim(product="3110", modules=2)

        def test_of_the_module(virtual_module):
            assert virtual_module.ready["products"] == ["TMCM-3110"] * 2

        @pytest.mark.tmcl_sim(product="6110", paused=False)
        class TestOfTheClass:
            def test_it(self, virtual_module):
                assert virtual_module.ready["products"] == ["TMCM-6110"] * 2
                assert virtual_module.state().time == "running"

            @pytest.mark.tmcl_sim(modules=1, paused=True)
            def test_nearer(self, virtual_module):
                assert virtual_module.ready["products"] == ["TMCM-6110"]
                assert virtual_module.state().time == "paused"

        @pytest.mark.parametrize("axes", [pytest.param(6, marks=pytest.mark.tmcl_sim(product="6110"))])
        def test_of_a_parameter(virtual_module, axes):
            assert len(virtual_module.state().axes) == axes
        """
    )
    pytester.runpytest().assert_outcomes(passed=4)


def test_paths_are_relative_to_the_test(pytester: pytest.Pytester) -> None:
    folder = pytester.mkdir("below")
    (folder / "stage.toml").write_text("[motor]\nload = 0.5\n")
    (folder / "test_it.py").write_text(
        "import pytest\n"
        "@pytest.mark.tmcl_sim('stage.toml', eeprom='module.bin', log='telegrams.txt')\n"
        "def test_it(virtual_module):\n"
        "    assert virtual_module.load == 0.5\n"
    )
    pytester.runpytest().assert_outcomes(passed=1)
    assert (folder / "module.bin").exists()
    assert (folder / "telegrams.txt").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            "wrold='a.toml'",
            "@pytest.mark.tmcl_sim(wrold='a.toml'): there is no argument 'wrold'; did you mean 'world'?",
        ),
        ("quickly=1", "@pytest.mark.tmcl_sim(quickly=1): there is no argument 'quickly'; there are: world, paused, *"),
        ("'a.toml', 1", "@pytest.mark.tmcl_sim('a.toml', 1): only the world can stand without a name"),
        ("world='a.toml'", "*StartError: tmcl: --world: cannot read *a.toml: there is no such file or folder"),
    ],
)
def test_wrong_arguments_are_told(pytester: pytest.Pytester, arguments: str, words: str) -> None:
    pytester.makepyfile(f"import pytest\n@pytest.mark.tmcl_sim({arguments})\ndef test_it(virtual_module): pass")
    result = pytester.runpytest()
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines([words.replace("[", "[[]")])


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ("--tmcl-sim-plots=file", "*File exists: *"),
        ("--basetemp=file/folder", "*Not a directory: *"),
        ("-pno:tmpdir", "pytest runs without its plugin tmpdir, so name a folder: --tmcl-sim-plots=DIR"),
    ],
)
def test_a_plot_that_cannot_be_written_is_told(pytester: pytest.Pytester, option: str, words: str) -> None:
    pytester.makepyfile(test_failing=FAILING)
    pytester.path.joinpath("file").write_text("a file")
    result = pytester.runpytest_subprocess(option)
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines([*SECTIONS[:-1], f"The plot cannot be written: {words}"])


def test_a_fault_of_the_plugin_costs_no_report(pytester: pytest.Pytester) -> None:
    pytester.makeconftest(
        "import tmcl_sim.witness\ndef fail(*_): raise RuntimeError('a fault')\ntmcl_sim.witness.as_svg = fail"
    )
    pytester.makepyfile(test_failing=FAILING)
    result = pytester.runpytest_subprocess()
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines([*SECTIONS[:9], "*- tmcl_sim -*", "No more can be told: RuntimeError('a fault')"])


def test_an_image_runs_in_all_tests_that_it_is_for(pytester: pytest.Pytester, pytestconfig: pytest.Config) -> None:
    image = pytestconfig.getoption("--tmcl-sim-image")
    if image is None:
        pytest.skip("this test needs --tmcl-sim-image=ELF, with the image of a TMCM-1140")
    path = pytestconfig.invocation_params.dir / image
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.tmcl_sim(modules=2)
        def test_image(virtual_module):
            assert virtual_module.ready["image"]

        @pytest.mark.tmcl_sim(image=None)
        def test_none(virtual_module):
            assert virtual_module.ready["image"] is None

        @pytest.mark.parametrize("argument", [
            pytest.param(0, marks=pytest.mark.tmcl_sim(product="1140")),
            pytest.param(1, marks=pytest.mark.tmcl_sim(product=("1140", "6110"))),
            pytest.param(2, marks=pytest.mark.tmcl_sim(firmware="canopen")),
        ])
        def test_others(virtual_module, argument):
            assert argument == 0
        """
    )
    result = pytester.runpytest(f"--tmcl-sim-image={path}", "-rs")
    result.assert_outcomes(passed=3, skipped=2)
    result.stdout.fnmatch_lines(["*the image is for the TMCM-1140 with the firmware tmcl, this test is not"])


def test_an_image_that_is_none_is_told(pytester: pytest.Pytester) -> None:
    pytester.path.joinpath("image").write_text("no image")
    pytester.makepyfile("def test_it(virtual_module): pass")
    result = pytester.runpytest("--tmcl-sim-image=image")
    result.assert_outcomes(errors=1)
    result.stdout.fnmatch_lines(["E *StartError: tmcl: --image: *"])


def test_the_help_tells_of_options_and_marker(pytester: pytest.Pytester) -> None:
    pytester.runpytest("--help").stdout.fnmatch_lines(["virtual TMCM modules:", "*--tmcl-sim-image=ELF*"])
    pytester.runpytest("--markers").stdout.fnmatch_lines(["@pytest.mark.tmcl_sim(world=None, [*][*]arguments): *"])
    fixtures = pytester.runpytest("--fixtures").stdout
    fixtures.fnmatch_lines(["virtual_module -- *", "*A fresh virtual module: *"])
    fixtures.fnmatch_lines(["tmcl_sim -- *", "*The same as virtual_module, *"])


def test_the_fixture_hides_no_module_and_has_its_old_name_as_well(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest, tmcl_sim

        def test_an_exception(virtual_module):
            with pytest.raises(tmcl_sim.Refused):
                virtual_module.send("SAP 4, 0, 5000")

        @pytest.mark.tmcl_sim(product="6110")
        def test_the_old_name(tmcl_sim, virtual_module):
            assert tmcl_sim is virtual_module
            assert tmcl_sim.product == "TMCM-6110"
        """
    )
    pytester.runpytest().assert_outcomes(passed=2)


def test_what_has_happened_is_marked(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.tmcl_sim(product="3110", modules=2)
        def test_it(virtual_module):
            virtual_module.send("MVP ABS, 0, 51200")
            virtual_module.press("left")
            virtual_module.at(0.5, "load 0.25 2")
            virtual_module.step(1.0)
            virtual_module.axis(1)
            virtual_module.fault("spi")
            virtual_module.power(False)
            virtual_module.module(2).slip(4)
            virtual_module.control("module 2 press  home 1")
            virtual_module.control("temperature 40")
            virtual_module.at(0.001, "power on")
            assert False
        """
    )
    result = pytester.runpytest("--basetemp=temporary")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(
        [
            "*- tmcl_sim: motion of module 1, TMCM-3110 -*",
            "       +^-*-^-*-^",
            "        0.06* s *  1.06* s",
            "^ what has happened",
            "0.06* s  press left",
            "0.56* s  load 0.25 2",
            "1.06* s  fault spi on",
            "1.06* s  power off",
            "1.06* s  temperature 40",
            "",
            "As an image: *",
            "*- tmcl_sim: motion of module 2, TMCM-3110 -*",
            "^ what has happened",
            "1.06* s  slip 4",
            "1.06* s  press home 1",
            "",
        ],
        consecutive=False,
    )
    result.stdout.no_fnmatch_line("* s  slip 0*")
    result.stdout.no_fnmatch_line("* s  power on")
    first, second = (ElementTree.parse(plot).getroot() for plot in plots(pytester))
    assert labels(first) >= {"press left", "load 0.25 2", "fault spi on, power off, temperature 40"}
    assert labels(second) >= {"slip 4, press home 1"}


def test_a_restart_undoes_what_has_happened(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        def test_it(virtual_module):
            virtual_module.press("left")
            virtual_module.restart()
            virtual_module.load = 0.5
            virtual_module.step(1.0)
            assert False
        """
    )
    result = pytester.runpytest()
    result.stdout.fnmatch_lines(["^ what has happened", "0.05* s  load 0.5", ""])
    result.stdout.no_fnmatch_line("* s  press left")
