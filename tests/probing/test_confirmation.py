"""Which canary proves what: probes and canaries sent and ended in every order in, proofs out."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.confirmation import Confirmations, Confirmed
from sphero_probe.probing.retries import SettledProbe
from sphero_probe.protocol.packets import Command, Response

NOTHING = Confirmed([], [])


def asked(number: int, target: int | None = None) -> PreparedProbe:
    return PreparedProbe(number, Command(0x13, number % 256, b"", target), Risk.PROBE, None, "")


def settled(probe: PreparedProbe) -> SettledProbe:
    command = probe.command
    answer = Answered(command, 0, b"", Response(0, 0x00, b"", command.did, command.cid), b"", 0.125)
    return SettledProbe(probe, ProbeResult(answer, 1))


def test_a_canary_proves_what_was_sent_before_it() -> None:
    confirmations = Confirmations()
    answered, silent = settled(asked(1)), asked(2)
    assert confirmations.answer(answered, confirmations.checks) == NOTHING
    assert confirmations.silence(silent, confirmations.checks) == NOTHING
    health = confirmations.send(2)
    assert confirmations.right(health) == NOTHING
    assert confirmations.right(health) == Confirmed([answered], [silent])
    assert not confirmations


def test_a_canary_does_not_prove_what_was_sent_after_it() -> None:
    confirmations = Confirmations()
    health = confirmations.send(1)
    late = settled(asked(1))
    assert confirmations.answer(late, confirmations.checks) == NOTHING
    assert confirmations.right(health) == NOTHING
    assert confirmations
    assert confirmations.right(confirmations.send(1)) == Confirmed([late], [])


def test_what_was_sent_before_a_canary_and_ends_after_it_is_proved_at_once() -> None:
    confirmations = Confirmations()
    stamp = confirmations.checks
    confirmations.right(confirmations.send(1))
    answered, silent = settled(asked(1)), asked(2)
    assert confirmations.answer(answered, stamp) == Confirmed([answered], [])
    assert confirmations.silence(silent, stamp) == Confirmed([], [silent])
    assert not confirmations


def test_a_later_canary_that_sings_first_makes_the_earlier_one_needless() -> None:
    confirmations = Confirmations()
    early, late = settled(asked(1)), settled(asked(2))
    confirmations.answer(early, confirmations.checks)
    first = confirmations.send(1)
    confirmations.answer(late, confirmations.checks)
    second = confirmations.send(1)
    third = confirmations.send(1)
    assert confirmations.right(second) == Confirmed([early, late], [])
    assert [confirmations.wants(health) for health in (first, second, third)] == [False, False, True]


def test_an_earlier_canary_leaves_the_later_one() -> None:
    confirmations = Confirmations()
    early, late = settled(asked(1)), settled(asked(2))
    confirmations.answer(early, confirmations.checks)
    first = confirmations.send(1)
    confirmations.answer(late, confirmations.checks)
    second = confirmations.send(1)
    assert confirmations.right(first) == Confirmed([early], [])
    assert (confirmations.wants(first), confirmations.wants(second)) == (False, True)
    assert confirmations.right(second) == Confirmed([late], [])


def test_a_canary_without_questions_proves_by_being_sent() -> None:
    confirmations = Confirmations()
    silent = asked(1)
    confirmations.silence(silent, confirmations.checks)
    assert confirmations.right(confirmations.send(0), 0) == Confirmed([], [silent])


def test_nodes_with_something_left_to_be_proved() -> None:
    confirmations = Confirmations()
    assert confirmations.nodes == set()
    confirmations.answer(settled(asked(1, 0x11)), confirmations.checks)
    confirmations.silence(asked(2, 0x12), confirmations.checks)
    health = confirmations.send(1)
    confirmations.silence(asked(3, None), confirmations.checks)
    assert confirmations.nodes == {0x11, 0x12, None}
    confirmations.right(health)
    assert confirmations.nodes == {None}


def test_what_is_cleared_comes_out_and_no_canary_is_wanted() -> None:
    confirmations = Confirmations()
    answered, silent = settled(asked(1)), asked(2)
    health = confirmations.send(2)
    confirmations.right(health)
    confirmations.answer(answered, confirmations.checks)
    confirmations.silence(silent, confirmations.checks)
    assert confirmations.clear() == Confirmed([answered], [silent])
    assert not confirmations.wants(health)
    assert not confirmations
    assert confirmations.clear() == NOTHING
    assert confirmations.send(1) > health


class Run(RuleBasedStateMachine):
    """Probes and canaries go out, and end in any order; a model knows when each is proved, and by what."""

    def __init__(self) -> None:
        super().__init__()
        self.confirmations = Confirmations()
        self.probes = 0
        self.flying: dict[int, int] = {}
        self.unproved: dict[int, tuple[int, bool]] = {}
        self.questions: dict[int, int] = {}
        self.sent_after: dict[int, set[int]] = {}
        self.came_out: set[int] = set()
        self.sang = 0

    def check(self, endings: Confirmed) -> None:
        """Compare what came out with what the model says is proved by now, each in the order of ending."""
        confirmed = [number for number, (stamp, _) in self.unproved.items() if stamp < self.sang]
        silent = [number for number in confirmed if self.unproved[number][1]]
        assert [asked.number for asked in endings.silent] == silent
        assert [one.asked.number for one in endings.answered] == [n for n in confirmed if n not in silent]
        assert not self.came_out & set(confirmed), "came out twice"
        self.came_out.update(confirmed)
        for number in confirmed:
            assert self.sang in self.sent_after, "no canary sang at all"
            assert number in self.sent_after[self.sang], "proved by a canary sent before it"
            del self.unproved[number]

    @rule(count=st.integers(1, 4))
    def send_probes(self, count: int) -> None:
        for _ in range(count):
            self.probes += 1
            self.flying[self.probes] = self.confirmations.checks

    @precondition(lambda self: self.flying)
    @rule(data=st.data(), silent=st.booleans())
    def end_a_probe(self, data: st.DataObject, silent: bool) -> None:
        number = data.draw(st.sampled_from(sorted(self.flying)))
        stamp = self.flying.pop(number)
        self.unproved[number] = (stamp, silent)
        probe = asked(number, 0x11 + number % 3)
        if silent:
            self.check(self.confirmations.silence(probe, stamp))
        else:
            self.check(self.confirmations.answer(settled(probe), stamp))

    @rule(questions=st.integers(1, 4))
    def send_a_canary(self, questions: int) -> None:
        health = self.confirmations.send(questions)
        assert health == self.confirmations.checks
        assert health not in self.sent_after
        self.questions[health] = questions
        self.sent_after[health] = set(range(1, self.probes + 1))

    @precondition(lambda self: self.questions)
    @rule(data=st.data(), at_once=st.integers(1, 4))
    def answer_a_canary(self, data: st.DataObject, at_once: int) -> None:
        health = data.draw(st.sampled_from(sorted(self.questions)))
        right = min(at_once, self.questions[health])
        self.questions[health] -= right
        if not self.questions[health]:
            self.sang = health
            self.questions = {number: left for number, left in self.questions.items() if number > health}
        self.check(self.confirmations.right(health, right))

    @precondition(lambda self: not self.flying)
    @rule()
    def give_up(self) -> None:
        endings = self.confirmations.clear()
        left = [asked.number for asked in endings.silent] + [one.asked.number for one in endings.answered]
        assert sorted(left) == sorted(self.unproved)
        assert not self.came_out & set(left), "came out twice"
        self.came_out.update(left)
        self.unproved.clear()
        self.questions.clear()

    @invariant()
    def what_is_left(self) -> None:
        assert bool(self.confirmations) == bool(self.unproved)
        assert self.confirmations.nodes == {0x11 + number % 3 for number in self.unproved}
        open_canaries = {health for health in self.sent_after if self.confirmations.wants(health)}
        assert open_canaries == set(self.questions)

    def teardown(self) -> None:
        for number in sorted(self.flying):
            self.unproved[number] = (self.flying.pop(number), True)
            self.check(self.confirmations.silence(asked(number, 0x11 + number % 3), self.unproved[number][0]))
        self.send_a_canary(1)
        last = self.confirmations.checks
        self.sang = last
        self.check(self.confirmations.right(last))
        assert self.came_out == set(range(1, self.probes + 1))
        assert not self.confirmations


TestRun = Run.TestCase
TestRun.settings = settings(max_examples=40, stateful_step_count=25, deadline=None)
