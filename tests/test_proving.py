"""Which canary proves what: probes and canaries sent and ended in every order in, proofs out."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from sphero_probe.catalogue.risk import Risk
from sphero_probe.link.exchange import Answered
from sphero_probe.probing.asking import Asked, Tried
from sphero_probe.probing.pending import Settled
from sphero_probe.probing.proving import Endings, Proofs
from sphero_probe.protocol.packets import Command, Response

NOTHING = Endings([], [])


def asked(number, target=None):
    return Asked(number, Command(0x13, number % 256, b"", target), Risk.PROBE, None, "")


def settled(probe):
    command = probe.command
    answer = Answered(command, 0, b"", Response(0, 0x00, b"", command.did, command.cid), b"", 0.125)
    return Settled(probe, Tried(answer, 1))


def test_a_canary_proves_what_was_sent_before_it():
    proofs = Proofs()
    answered, silent = settled(asked(1)), asked(2)
    assert proofs.answer(answered, proofs.canaries) == NOTHING
    assert proofs.silence(silent, proofs.canaries) == NOTHING
    canary = proofs.send(2)
    assert proofs.right(canary) == NOTHING
    assert proofs.right(canary) == Endings([answered], [silent])
    assert not proofs


def test_a_canary_does_not_prove_what_was_sent_after_it():
    proofs = Proofs()
    canary = proofs.send(1)
    late = settled(asked(1))
    assert proofs.answer(late, proofs.canaries) == NOTHING
    assert proofs.right(canary) == NOTHING
    assert proofs
    assert proofs.right(proofs.send(1)) == Endings([late], [])


def test_what_was_sent_before_a_canary_and_ends_after_it_is_proved_at_once():
    proofs = Proofs()
    stamp = proofs.canaries
    proofs.right(proofs.send(1))
    answered, silent = settled(asked(1)), asked(2)
    assert proofs.answer(answered, stamp) == Endings([answered], [])
    assert proofs.silence(silent, stamp) == Endings([], [silent])
    assert not proofs


def test_a_later_canary_that_sings_first_makes_the_earlier_one_needless():
    proofs = Proofs()
    early, late = settled(asked(1)), settled(asked(2))
    proofs.answer(early, proofs.canaries)
    first = proofs.send(1)
    proofs.answer(late, proofs.canaries)
    second = proofs.send(1)
    third = proofs.send(1)
    assert proofs.right(second) == Endings([early, late], [])
    assert [proofs.wants(canary) for canary in (first, second, third)] == [False, False, True]


def test_an_earlier_canary_leaves_the_later_one():
    proofs = Proofs()
    early, late = settled(asked(1)), settled(asked(2))
    proofs.answer(early, proofs.canaries)
    first = proofs.send(1)
    proofs.answer(late, proofs.canaries)
    second = proofs.send(1)
    assert proofs.right(first) == Endings([early], [])
    assert (proofs.wants(first), proofs.wants(second)) == (False, True)
    assert proofs.right(second) == Endings([late], [])


def test_a_canary_without_questions_proves_by_being_sent():
    proofs = Proofs()
    silent = asked(1)
    proofs.silence(silent, proofs.canaries)
    assert proofs.right(proofs.send(0), 0) == Endings([], [silent])


def test_nodes_with_something_left_to_be_proved():
    proofs = Proofs()
    assert proofs.nodes == set()
    proofs.answer(settled(asked(1, 0x11)), proofs.canaries)
    proofs.silence(asked(2, 0x12), proofs.canaries)
    canary = proofs.send(1)
    proofs.silence(asked(3, None), proofs.canaries)
    assert proofs.nodes == {0x11, 0x12, None}
    proofs.right(canary)
    assert proofs.nodes == {None}


def test_what_is_cleared_comes_out_and_no_canary_is_wanted():
    proofs = Proofs()
    answered, silent = settled(asked(1)), asked(2)
    canary = proofs.send(2)
    proofs.right(canary)
    proofs.answer(answered, proofs.canaries)
    proofs.silence(silent, proofs.canaries)
    assert proofs.clear() == Endings([answered], [silent])
    assert not proofs.wants(canary)
    assert not proofs
    assert proofs.clear() == NOTHING
    assert proofs.send(1) > canary


class Run(RuleBasedStateMachine):
    """Probes and canaries go out, and end in any order; a model knows when each is proved, and by what."""

    def __init__(self):
        super().__init__()
        self.proofs = Proofs()
        self.probes = 0
        self.flying = {}
        self.unproved = {}
        self.questions = {}
        self.sent_after = {}
        self.came_out = set()
        self.sang = 0

    def check(self, endings):
        """Compare what came out with what the model says is proved by now, each in the order of ending."""
        proved = [number for number, (stamp, _) in self.unproved.items() if stamp < self.sang]
        silent = [number for number in proved if self.unproved[number][1]]
        assert [asked.number for asked in endings.silent] == silent
        assert [one.asked.number for one in endings.answered] == [n for n in proved if n not in silent]
        assert not self.came_out & set(proved), "came out twice"
        self.came_out.update(proved)
        for number in proved:
            assert self.sang in self.sent_after, "no canary sang at all"
            assert number in self.sent_after[self.sang], "proved by a canary sent before it"
            del self.unproved[number]

    @rule(count=st.integers(1, 4))
    def send_probes(self, count):
        for _ in range(count):
            self.probes += 1
            self.flying[self.probes] = self.proofs.canaries

    @precondition(lambda self: self.flying)
    @rule(data=st.data(), silent=st.booleans())
    def end_a_probe(self, data, silent):
        number = data.draw(st.sampled_from(sorted(self.flying)))
        stamp = self.flying.pop(number)
        self.unproved[number] = (stamp, silent)
        probe = asked(number, 0x11 + number % 3)
        if silent:
            self.check(self.proofs.silence(probe, stamp))
        else:
            self.check(self.proofs.answer(settled(probe), stamp))

    @rule(questions=st.integers(1, 4))
    def send_a_canary(self, questions):
        canary = self.proofs.send(questions)
        assert canary == self.proofs.canaries
        assert canary not in self.sent_after
        self.questions[canary] = questions
        self.sent_after[canary] = set(range(1, self.probes + 1))

    @precondition(lambda self: self.questions)
    @rule(data=st.data(), at_once=st.integers(1, 4))
    def answer_a_canary(self, data, at_once):
        canary = data.draw(st.sampled_from(sorted(self.questions)))
        right = min(at_once, self.questions[canary])
        self.questions[canary] -= right
        if not self.questions[canary]:
            self.sang = canary
            self.questions = {number: left for number, left in self.questions.items() if number > canary}
        self.check(self.proofs.right(canary, right))

    @precondition(lambda self: not self.flying)
    @rule()
    def give_up(self):
        endings = self.proofs.clear()
        left = [asked.number for asked in endings.silent] + [one.asked.number for one in endings.answered]
        assert sorted(left) == sorted(self.unproved)
        assert not self.came_out & set(left), "came out twice"
        self.came_out.update(left)
        self.unproved.clear()
        self.questions.clear()

    @invariant()
    def what_is_left(self):
        assert bool(self.proofs) == bool(self.unproved)
        assert self.proofs.nodes == {0x11 + number % 3 for number in self.unproved}
        open_canaries = {canary for canary in self.sent_after if self.proofs.wants(canary)}
        assert open_canaries == set(self.questions)

    def teardown(self):
        for number in sorted(self.flying):
            self.unproved[number] = (self.flying.pop(number), True)
            self.check(self.proofs.silence(asked(number, 0x11 + number % 3), self.unproved[number][0]))
        self.send_a_canary(1)
        last = self.proofs.canaries
        self.sang = last
        self.check(self.proofs.right(last))
        assert self.came_out == set(range(1, self.probes + 1))
        assert not self.proofs


TestRun = Run.TestCase
TestRun.settings = settings(max_examples=40, stateful_step_count=25, deadline=None)
