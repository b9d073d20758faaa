"""Virtual time under the control of a test."""

from __future__ import annotations

import itertools
import pickle
import threading
from collections.abc import Iterator

import pytest

from tmcl_sim import NotMet, Sample, Sim, SimError
from tmcl_sim.watch import _sample as sample_of


@pytest.fixture
def sim() -> Iterator[Sim]:
    with Sim() as sim:
        yield sim


def test_time_passes_by_steps(sim: Sim) -> None:
    start = sim.time
    assert sim.step(0.0123456) == sim.time == pytest.approx(start + 0.012346)
    assert sim.state().time == "paused"
    with pytest.raises(SimError, match="an hour, '1 h', is the longest"):
        sim.step(7200)
    with pytest.raises(ValueError, match=r"^a time is a number of seconds, not nan$"):
        sim.step(float("nan"))


def test_a_condition_is_waited_for(sim: Sim) -> None:
    sim.send("MVP ABS, 0, 51200")
    assert sim.run_until("position = 51200", max=5.0) == sim.time
    with pytest.raises(NotMet, match=r"^not within 0\.1 s: velocity > 0 \(now velocity = 0\)$") as missed:
        sim.run_until("velocity > 0", max=0.1)
    assert (missed.value.condition, missed.value.longest) == ("velocity > 0", 0.1)
    assert missed.value.values == {"velocity": 0}
    assert missed.value.state.position == 51200
    with pytest.raises(SimError, match=r"^unknown value 'velocty'; did you mean 'velocity'\?$"):
        sim.run_until("velocty = 0", max=0.1)


@pytest.mark.parametrize(
    ("condition", "now"),
    [
        ("rotor 0 = 1", {"rotor 0": 0}),
        ("switches.left + inputs.3 = 2", {"switches.left": 0, "inputs.3": 0}),
        ("can = 0", {"can": 2}),
        ("GAP 4, 0 between 1 and 2", {}),
    ],
)
def test_a_condition_that_is_not_met_tells_its_values(sim: Sim, condition: str, now: dict[str, float]) -> None:
    with pytest.raises(NotMet) as missed:
        sim.run_until(condition, max=0.001)
    assert missed.value.values == now
    assert str(pickle.loads(pickle.dumps(missed.value))) == str(missed.value)


def test_a_command_is_put_off(sim: Sim) -> None:
    due = sim.at(0.0025, "power off")
    assert due == pytest.approx(sim.time + 0.0025)
    sim.step(0.002)
    assert sim.state().power
    sim.step(0.001)
    assert not sim.state().power


def test_time_passes_with_replies() -> None:
    with Sim(paused=0.010) as sim:
        start = sim.time
        sim.send("GAP 6, 0")
        sim.send("GAP 6, 0")
        assert 0.010 < sim.time - start <= 0.030
        sim.pause()
        sim.send("GAP 6, 0")
        start = sim.time
        sim.send("GAP 6, 0")
        assert sim.time - start < 0.010


def test_time_goes_by_the_clock() -> None:
    with Sim(paused=False, speed="max") as sim:
        assert (sim.state().time, sim.speed) == ("running", "max")
        sim.speed = 2.5
        assert sim.speed == 2.5
        sim.speed = "max"
        with pytest.raises(SimError, match=r"^time goes by the clock, so there is no 'step': write 'pause' before it$"):
            sim.step(0.1)
        sim.pause(0.005)
        assert sim.state().time == "paused"
        sim.resume()
        assert sim.state().time == "running"


def test_a_restart_begins_anew(sim: Sim) -> None:
    start = sim.time
    sim.send("MVP ABS, 0, 1000")
    sim.press("left")
    sim.step(1.0)
    sim.restart()
    state = sim.state()
    assert (sim.time, state.position, state.switches.left) == (start, 0, False)


def test_a_watch_tells_values_as_time_passes(sim: Sim) -> None:
    with sim.watch(0.1, "position", "velocity", "GAP 4, 0") as watch:
        assert watch.samples() == []
        begin = sim.time
        sim.send("MVP ABS, 0, 51200")
        sim.step(0.5)
        samples = watch.samples()
        assert [sample.time for sample in samples] == pytest.approx([begin + 0.1 * count for count in range(1, 6)])
        positions = [sample["position"] or 0 for sample in samples]
        assert all(before < after for before, after in itertools.pairwise(positions))
        assert (samples[-1]["velocity"], samples[-1]["GAP 4, 0"], samples[-1].missed) == (1000, 1000, 0)
        assert watch.samples() == []
        sim.restart()
        sim.step(0.2)
        assert [sample.time for sample in watch.samples()] == pytest.approx([begin + 0.1, begin + 0.2])
        sim.step(0.1)
        watch.stop()
        sim.step(0.1)
        watch.stop()
        assert len(watch.samples()) == 1
        assert watch.samples() == []
    watch.close()
    with pytest.raises(SimError, match=r"^this watch is closed$"):
        watch.samples()
    with pytest.raises(SimError, match="unknown value 'roter'; did you mean 'rotor'"):
        sim.watch(0.1, "roter")


def test_a_watch_that_was_stopped_stays_so_after_a_restart(sim: Sim) -> None:
    with sim.watch(0.1, "rotor") as stopped, sim.watch(0.1, "rotor") as closed, sim.watch(0.1, "rotor") as watch:
        stopped.stop()
        closed.close()
        sim.restart()
        sim.step(0.5)
        assert (len(stopped.samples()), len(watch.samples())) == (0, 5)


def test_a_watch_tells_how_many_samples_are_lost() -> None:
    line = b'{"time_us":12500,"missed":3,"rotor":-7,"GAP 4, 0":null}\n'
    # A reader that is too slow takes a second of real time at least; this is the line that it gets.
    sample = sample_of(line)
    assert (sample.time, sample.missed, dict(sample.values)) == (0.0125, 3, {"rotor": -7, "GAP 4, 0": None})


def test_an_iteration_gives_what_has_come(sim: Sim) -> None:
    with sim.watch(0.1, "rotor") as watch:
        sim.step(0.25)
        assert len(list(watch)) == 2
        assert list(watch) == []


def test_a_long_step_loses_no_sample() -> None:
    def run() -> list[tuple[float, float | None]]:
        with Sim() as sim, sim.watch(0.001, "position") as watch:
            start = sim.time
            sim.send("ROR 0, 1")
            sim.step(100)
            samples = watch.samples()
            assert samples[-1]["position"] == sim.state().position
            assert sum(sample.missed for sample in samples) == 0
            return [(round(sample.time - start, 6), sample["position"]) for sample in samples]

    first = run()
    assert [time for time, _ in first] == [count / 1000 for count in range(1, len(first) + 1)]
    assert len(first) >= 100_000
    assert run() == first
    assert run() == first


def test_a_watch_keeps_the_last_samples(sim: Sim) -> None:
    with sim.watch(0.001, "rotor", kept=10) as watch:
        begin = sim.time
        sim.step(1.0)
        samples = watch.samples()
        assert [sample.time for sample in samples] == pytest.approx([begin + 0.991 + 0.001 * n for n in range(10)])


def test_threads_share_a_watch(sim: Sim) -> None:
    def ask() -> None:
        for _ in range(20):
            sim.step(0.01)
            found.extend(watch.samples())

    found: list[Sample] = []
    with sim.watch(0.01, "rotor") as watch:
        threads = [threading.Thread(target=ask) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    assert len({sample.time for sample in found}) == len(found) == 80


def test_threads_take_turns(sim: Sim) -> None:
    def ask() -> None:
        for _ in range(20):
            sim.send("GAP 6, 0")
            sim.step(0.001)

    threads = [threading.Thread(target=ask) for _ in range(4)]
    start = sim.time
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sim.time >= start + 4 * 20 * 0.001
