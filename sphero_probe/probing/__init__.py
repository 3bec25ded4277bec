"""Run plans on a robot and judge the answers. The main class is ``engine.Engine``: it runs one plan.

Theory of operation
===================

``Engine`` takes the stages of a plan one after the other. A probe is *filled in* (``prober``: node,
payload, what the catalogue knows), its node and device are *calibrated* where that matters
(``calibrator``, ``calibration``, ``device_calibration``), and it is *prepared*: assessed once by
``link.policy``. What the policy blocks becomes a finding at once. The rest goes to
``pipeline.Pipeline``, which returns settled probes; ``judge`` makes each one a finding.
``recorder`` records every intent before its frame is sent, and every finding as soon as it is made.

The pipeline keeps the robot busy. ``scheduler`` decides what is sent next, ``inflight`` holds what
has no answer yet, ``attempt`` and ``retries`` hold what happened to a probe so far.

*What a health check proves.* Every few probes, ``health`` sends an echo with a nonce and a command
that is known to be absent. A robot serves its commands in order. So a check that passes confirms the
answers and the silences of everything that was sent before it (``confirmation``). A check that fails
voids them: the robot slept, rebooted or changed its mode. Then the robot is woken (``recovery``) and
the voided probes are sent again. A node that does not recover is given up, and its probes end as
inconclusive. All of this goes node by node: what another node answered stands if it passed the check
that the first one failed, and passes one again.

*What a robot is made of.* ``nodes`` asks which nodes there are, outside any plan; ``system`` holds what
it found.

*When silence counts.* A silent probe is sent again until chance no longer explains its silence, given
how much the link loses (``retries.LossEstimate``). Each silence counts only once a health check
after it has passed. It stays inconclusive where bytes arrived that may be its answer
(``near_misses``), where its class forbids a retry, and where its node answers no health check. At
the end of a run the engine waits once for late answers to all silent probes (``late_answers``).

*What a dropped link does.* ``session.reconnect`` connects to the same robot again. Probes that were in
flight are then sent alone (``dropped``). The one that drops the link twice is the suspect and is not
sent a third time. A command that may have been executed is never sent again.

*What a wrong length proves.* Unknown commands get a length that no command takes. Each
command handler of a firmware checks lengths by itself, so each device is measured first: its documented reads
and harmless setters get surplus bytes, and a command that cannot exist shows which answers prove nothing
there. Until two existing commands of a device have rejected a wrong length, only one such probe is in flight.
A command that accepts a wrong length was executed (``executions``). This is reported at once, and no
further wrong length is sent to that node.
"""
