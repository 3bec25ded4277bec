"""Keep track of which results are confirmed by a passed health check.

A node serves its commands in order. So a health check that a node passes confirms everything that was sent to
it before. Each node stands for itself: one may hang while another answers.

A health check has two questions: an echo, and a command that the node called absent. While probes follow, the
second one need not be sent: any of them that the node calls absent proves the same.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from sphero_probe.probing.attempt import PreparedProbe
from sphero_probe.probing.retries import SettledProbe


class Confirmed(NamedTuple):
    """Probes whose result a health check confirmed.

    Attributes:
        answered: probes with an answer.
        silent: probes without one.
    """

    answered: list[SettledProbe]
    silent: list[PreparedProbe]


@dataclass(slots=True)
class _OpenCheck:
    """A health check that was sent and has neither passed nor been replaced by a later one.

    Attributes:
        questions: sent, and not answered yet.
        wants_absent: no command that was sent after it was called absent yet, and none was asked for.
    """

    questions: int
    wants_absent: bool

    @property
    def is_passed(self) -> bool:
        return not (self.questions or self.wants_absent)


class NodeConfirmations:
    """Results of one node that wait for a health check that was sent after their probe.

    Attributes:
        checks: number of the last health check; the next one confirms what is sent now.
        confirmed_to: number of the last health check that the node passed.
    """

    def __init__(self) -> None:
        self.checks = 0
        self._answered: list[tuple[int, SettledProbe]] = []
        self._silent: list[tuple[int, PreparedProbe]] = []
        self._open: dict[int, _OpenCheck] = {}
        self.confirmed_to = 0

    def __bool__(self) -> bool:
        """Whether any result is not confirmed yet."""
        return bool(self._answered or self._silent)

    def answer(self, settled: SettledProbe, stamp: int) -> Confirmed:
        """Add an answer; return what is confirmed now.

        Args:
            settled: the probe and its answer.
            stamp: what ``checks`` was when it was sent.
        """
        if stamp < self.confirmed_to:  # all that are kept are not confirmed, so nothing else changes
            return Confirmed([settled], [])
        self._answered.append((stamp, settled))
        return Confirmed([], [])

    def silence(self, probe: PreparedProbe, stamp: int) -> Confirmed:
        """Add a probe that stayed silent; return what is confirmed now.

        Args:
            probe: the probe.
            stamp: what ``checks`` was when it was sent.
        """
        if stamp < self.confirmed_to:
            return Confirmed([], [probe])
        self._silent.append((stamp, probe))
        return Confirmed([], [])

    def send(self, questions: int, number: int = 0, *, wants_absent: bool = False) -> int:
        """Record that a health check is sent; return its number.

        Args:
            questions: how many are sent.
            number: of the check, 0 for the next.
            wants_absent: a probe that is called absent must answer one more; see ``absent``.
        """
        self.checks = number or self.checks + 1
        self._open[self.checks] = _OpenCheck(questions, wants_absent)
        return self.checks

    @property
    def wants_absent(self) -> bool:
        """Whether an open health check still waits for a probe that is called absent."""
        return any(check.wants_absent for check in self._open.values())

    def absent(self, stamp: int) -> Confirmed:
        """Record that a probe was called absent; return what is confirmed now.

        Args:
            stamp: what ``checks`` was when it was sent.
        """
        for number, check in self._open.items():
            if number <= stamp:
                check.wants_absent = False
        passed = [number for number, check in self._open.items() if number <= stamp and check.is_passed]
        return self._pass(max(passed)) if passed else Confirmed([], [])

    def needs(self, check: int) -> bool:
        """Whether the result of this health check still matters: no later one has passed."""
        return check in self._open

    def passed(self, check: int, questions: int = 1) -> Confirmed:
        """Record correct answers to questions of a health check; return what is confirmed now."""
        self._open[check].questions -= questions
        return self._pass(check) if self._open[check].is_passed else Confirmed([], [])

    def clear(self) -> Confirmed:
        """Forget every health check; return the results that none of them confirmed."""
        left = Confirmed([settled for _, settled in self._answered], [probe for _, probe in self._silent])
        self._answered.clear()
        self._silent.clear()
        self._open.clear()
        return left

    def _pass(self, check: int) -> Confirmed:
        self.confirmed_to = check
        for earlier in [number for number in self._open if number <= check]:
            del self._open[earlier]
        return self._confirmed()

    def _confirmed(self) -> Confirmed:
        confirmed = Confirmed(
            [settled for stamp, settled in self._answered if stamp < self.confirmed_to],
            [probe for stamp, probe in self._silent if stamp < self.confirmed_to],
        )
        if confirmed.answered:
            self._answered = [entry for entry in self._answered if entry[0] >= self.confirmed_to]
        if confirmed.silent:
            self._silent = [entry for entry in self._silent if entry[0] >= self.confirmed_to]
        return confirmed


class Confirmations:
    """The results of all nodes of a robot; the health checks of all nodes share their numbers.

    Attributes:
        checks: how many health checks were sent so far; the next one confirms what is sent now.
    """

    def __init__(self) -> None:
        self.checks = 0
        self._nodes: dict[int | None, NodeConfirmations] = {}

    def __bool__(self) -> bool:
        """Whether any result is not confirmed yet."""
        return any(self._nodes.values())

    @property
    def nodes(self) -> set[int | None]:
        """Addresses of the nodes with results that are not confirmed yet."""
        return {target for target, node in self._nodes.items() if node}

    def confirmed_to(self, target: int | None) -> int:
        """Return the number of the last health check that a node passed, 0 for none."""
        return self._node(target).confirmed_to

    def answer(self, settled: SettledProbe, stamp: int) -> Confirmed:
        """Add an answer; return what is confirmed now.

        Args:
            settled: the probe and its answer.
            stamp: what ``checks`` was when it was sent.
        """
        return self._node(settled.probe.command.target).answer(settled, stamp)

    def silence(self, probe: PreparedProbe, stamp: int) -> Confirmed:
        """Add a probe that stayed silent; return what is confirmed now.

        Args:
            probe: the probe.
            stamp: what ``checks`` was when it was sent.
        """
        return self._node(probe.command.target).silence(probe, stamp)

    def send(self, questions: Mapping[int | None, int], wants_absent: Collection[int | None] = ()) -> int:
        """Record that a health check is sent; return its number.

        Args:
            questions: node -> how many are sent to it.
            wants_absent: nodes of which a probe that is called absent must answer one more.
        """
        self.checks += 1
        for target, count in questions.items():
            self._node(target).send(count, self.checks, wants_absent=target in wants_absent)
        return self.checks

    def wants_absent(self, target: int | None) -> bool:
        """Whether a health check of a node still waits for a probe that is called absent."""
        return self._node(target).wants_absent

    def absent(self, target: int | None, stamp: int) -> Confirmed:
        """Record that a node called a probe absent; return what is confirmed now.

        Args:
            target: the node.
            stamp: what ``checks`` was when the probe was sent.
        """
        return self._node(target).absent(stamp)

    def needs(self, check: int, target: int | None) -> bool:
        """Whether the result of this health check still matters for a node: no later one has passed."""
        return self._node(target).needs(check)

    def passed(self, check: int, target: int | None, questions: int = 1) -> Confirmed:
        """Record a node's correct answers to questions of a health check; return what is confirmed now."""
        return self._node(target).passed(check, questions)

    def clear(self, nodes: Collection[int | None] | None = None) -> Confirmed:
        """Forget every health check of some nodes, by default of all; return what none of them confirmed."""
        left = [node.clear() for target, node in self._nodes.items() if nodes is None or target in nodes]
        answered = [settled for one in left for settled in one.answered]
        return Confirmed(answered, [probe for one in left for probe in one.silent])

    def _node(self, target: int | None) -> NodeConfirmations:
        node = self._nodes.get(target)
        if node is None:
            node = self._nodes[target] = NodeConfirmations()
        return node
