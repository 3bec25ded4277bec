"""Which health check confirms which results, with probes and checks that end in every order."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.attempt import PreparedProbe, ProbeResult
from sphero_probe.probing.confirmation import Confirmations, Confirmed, NodeConfirmations
from sphero_probe.probing.retries import SettledProbe
from sphero_probe.protocol.packets import Command, Response

NOTHING = Confirmed([], [])


def prepared(number: int, target: int | None = None) -> PreparedProbe:
    return PreparedProbe(number, Command(0x13, number % 256, b"", target), Risk.PROBE, None, "")


def settled(probe: PreparedProbe) -> SettledProbe:
    command = probe.command
    answer = Answered(command, 0, b"", Response(0, 0x00, b"", command.did, command.cid), b"", 0.125)
    return SettledProbe(probe, ProbeResult(answer, 1))


def test_a_passed_check_confirms_what_was_sent_before_it() -> None:
    confirmations = NodeConfirmations()
    answered, silent = settled(prepared(1)), prepared(2)
    assert confirmations.answer(answered, confirmations.checks) == NOTHING
    assert confirmations.silence(silent, confirmations.checks) == NOTHING
    check = confirmations.send(2)
    assert confirmations.passed(check) == NOTHING
    assert confirmations.passed(check) == Confirmed([answered], [silent])
    assert not confirmations


def test_a_passed_check_does_not_confirm_what_was_sent_after_it() -> None:
    confirmations = NodeConfirmations()
    check = confirmations.send(1)
    late = settled(prepared(1))
    assert confirmations.answer(late, confirmations.checks) == NOTHING
    assert confirmations.passed(check) == NOTHING
    assert confirmations
    assert confirmations.passed(confirmations.send(1)) == Confirmed([late], [])


def test_what_was_sent_before_a_passed_check_and_ends_after_it_is_confirmed_at_once() -> None:
    confirmations = NodeConfirmations()
    stamp = confirmations.checks
    confirmations.passed(confirmations.send(1))
    answered, silent = settled(prepared(1)), prepared(2)
    assert confirmations.answer(answered, stamp) == Confirmed([answered], [])
    assert confirmations.silence(silent, stamp) == Confirmed([], [silent])
    assert not confirmations


def test_a_later_check_that_passes_first_makes_the_earlier_one_needless() -> None:
    confirmations = NodeConfirmations()
    early, late = settled(prepared(1)), settled(prepared(2))
    confirmations.answer(early, confirmations.checks)
    first = confirmations.send(1)
    confirmations.answer(late, confirmations.checks)
    second = confirmations.send(1)
    third = confirmations.send(1)
    assert confirmations.passed(second) == Confirmed([early, late], [])
    assert [confirmations.needs(check) for check in (first, second, third)] == [False, False, True]


def test_a_later_probe_that_is_called_absent_answers_the_question_that_was_not_sent() -> None:
    confirmations = NodeConfirmations()
    first = settled(prepared(1))
    confirmations.answer(first, confirmations.checks)
    check = confirmations.send(1, wants_absent=True)
    assert confirmations.passed(check) == NOTHING
    assert confirmations.absent(check - 1) == NOTHING  # sent before the check: it proves nothing
    assert confirmations.absent(check) == Confirmed([first], [])
    assert not confirmations.wants_absent
    assert not confirmations.needs(check)


def test_a_probe_that_is_called_absent_does_not_replace_the_echo() -> None:
    confirmations = NodeConfirmations()
    first = settled(prepared(1))
    confirmations.answer(first, confirmations.checks)
    check = confirmations.send(1, wants_absent=True)
    assert confirmations.absent(check) == NOTHING
    assert confirmations.needs(check)
    assert confirmations.passed(check) == Confirmed([first], [])


def test_a_check_with_both_questions_confirms_one_that_still_waits() -> None:
    confirmations = NodeConfirmations()
    first = settled(prepared(1))
    confirmations.answer(first, confirmations.checks)
    assert confirmations.passed(confirmations.send(1, wants_absent=True)) == NOTHING
    assert confirmations.passed(confirmations.send(2), 2) == Confirmed([first], [])


def test_an_earlier_check_leaves_the_later_one() -> None:
    confirmations = NodeConfirmations()
    early, late = settled(prepared(1)), settled(prepared(2))
    confirmations.answer(early, confirmations.checks)
    first = confirmations.send(1)
    confirmations.answer(late, confirmations.checks)
    second = confirmations.send(1)
    assert confirmations.passed(first) == Confirmed([early], [])
    assert (confirmations.needs(first), confirmations.needs(second)) == (False, True)
    assert confirmations.passed(second) == Confirmed([late], [])


def test_a_check_without_questions_confirms_by_being_sent() -> None:
    confirmations = NodeConfirmations()
    silent = prepared(1)
    confirmations.silence(silent, confirmations.checks)
    assert confirmations.passed(confirmations.send(0), 0) == Confirmed([], [silent])


def test_each_node_is_confirmed_by_its_own_checks() -> None:
    confirmations = Confirmations()
    assert confirmations.nodes == set()
    answered, silent = settled(prepared(1, 0x11)), prepared(2, 0x12)
    confirmations.answer(answered, confirmations.checks)
    confirmations.silence(silent, confirmations.checks)
    check = confirmations.send({0x11: 1, 0x12: 1})
    assert confirmations.nodes == {0x11, 0x12}
    assert confirmations.passed(check, 0x11) == Confirmed([answered], [])
    assert (confirmations.confirmed_to(0x11), confirmations.confirmed_to(0x12)) == (check, 0)
    assert not confirmations.needs(check, 0x11)
    assert confirmations.needs(check, 0x12)
    late = settled(prepared(3, 0x11))
    confirmations.answer(late, confirmations.checks)
    assert confirmations.clear({0x12}) == Confirmed([], [silent])
    assert confirmations.nodes == {0x11}
    assert confirmations.clear() == Confirmed([late], [])


def test_clearing_returns_what_is_unconfirmed_and_no_check_is_needed() -> None:
    confirmations = NodeConfirmations()
    answered, silent = settled(prepared(1)), prepared(2)
    check = confirmations.send(2)
    confirmations.passed(check)
    confirmations.answer(answered, confirmations.checks)
    confirmations.silence(silent, confirmations.checks)
    assert confirmations.clear() == Confirmed([answered], [silent])
    assert not confirmations.needs(check)
    assert not confirmations
    assert confirmations.clear() == NOTHING
    assert confirmations.send(1) > check


class Run(RuleBasedStateMachine):
    """Send probes and health checks that end in any order; a model knows which check confirms each probe."""

    def __init__(self) -> None:
        super().__init__()
        self.confirmations = NodeConfirmations()
        self.probes = 0
        self.in_flight: dict[int, int] = {}
        self.unconfirmed: dict[int, tuple[int, bool]] = {}
        self.questions: dict[int, int] = {}
        self.sent_after: dict[int, set[int]] = {}
        self.returned: set[int] = set()
        self.passed_check = 0

    def check(self, returned: Confirmed) -> None:
        """Compare what was returned with what the model says is confirmed, each in the order of ending."""
        confirmed = [number for number, (stamp, _) in self.unconfirmed.items() if stamp < self.passed_check]
        silent = [number for number in confirmed if self.unconfirmed[number][1]]
        assert [probe.number for probe in returned.silent] == silent
        answered = [settled_probe.probe.number for settled_probe in returned.answered]
        assert answered == [number for number in confirmed if number not in silent]
        assert not self.returned & set(confirmed), "returned twice"
        self.returned.update(confirmed)
        for number in confirmed:
            assert self.passed_check in self.sent_after, "no check passed at all"
            assert number in self.sent_after[self.passed_check], "confirmed by a check sent before it"
            del self.unconfirmed[number]

    @rule(count=st.integers(1, 4))
    def send_probes(self, count: int) -> None:
        for _ in range(count):
            self.probes += 1
            self.in_flight[self.probes] = self.confirmations.checks

    @precondition(lambda self: self.in_flight)
    @rule(data=st.data(), silent=st.booleans())
    def end_a_probe(self, data: st.DataObject, silent: bool) -> None:
        number = data.draw(st.sampled_from(sorted(self.in_flight)))
        stamp = self.in_flight.pop(number)
        self.unconfirmed[number] = (stamp, silent)
        probe = prepared(number, 0x11 + number % 3)
        if silent:
            self.check(self.confirmations.silence(probe, stamp))
        else:
            self.check(self.confirmations.answer(settled(probe), stamp))

    @rule(questions=st.integers(1, 4))
    def send_a_check(self, questions: int) -> None:
        check = self.confirmations.send(questions)
        assert check == self.confirmations.checks
        assert check not in self.sent_after
        self.questions[check] = questions
        self.sent_after[check] = set(range(1, self.probes + 1))

    @precondition(lambda self: self.questions)
    @rule(data=st.data(), at_once=st.integers(1, 4))
    def answer_a_check(self, data: st.DataObject, at_once: int) -> None:
        check = data.draw(st.sampled_from(sorted(self.questions)))
        passed = min(at_once, self.questions[check])
        self.questions[check] -= passed
        if not self.questions[check]:
            self.passed_check = check
            self.questions = {number: left for number, left in self.questions.items() if number > check}
        self.check(self.confirmations.passed(check, passed))

    @precondition(lambda self: not self.in_flight)
    @rule()
    def give_up(self) -> None:
        confirmed = self.confirmations.clear()
        left = [probe.number for probe in confirmed.silent] + [
            settled_probe.probe.number for settled_probe in confirmed.answered
        ]
        assert sorted(left) == sorted(self.unconfirmed)
        assert not self.returned & set(left), "returned twice"
        self.returned.update(left)
        self.unconfirmed.clear()
        self.questions.clear()

    @invariant()
    def what_is_left(self) -> None:
        assert bool(self.confirmations) == bool(self.unconfirmed)
        open_checks = {check for check in self.sent_after if self.confirmations.needs(check)}
        assert open_checks == set(self.questions)

    def teardown(self) -> None:
        for number in sorted(self.in_flight):
            self.unconfirmed[number] = (self.in_flight.pop(number), True)
            self.check(
                self.confirmations.silence(prepared(number, 0x11 + number % 3), self.unconfirmed[number][0])
            )
        self.send_a_check(1)
        last = self.confirmations.checks
        self.passed_check = last
        self.check(self.confirmations.passed(last))
        assert self.returned == set(range(1, self.probes + 1))
        assert not self.confirmations


TestRun = Run.TestCase
TestRun.settings = settings(max_examples=40, stateful_step_count=25, deadline=None)
