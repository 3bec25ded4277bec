"""Plans in, findings out. The main class is ``engine.Engine``: one plan, asked of one robot.

Theory of operation
===================

``Engine`` takes the stages of a plan one after the other. A probe is *filled in* (``prober``: node,
payload, what the catalogue knows), its node and device are *calibrated* where that matters
(``calibrator``, ``calibration``, ``device_calibration``), and it is *prepared*: assessed once by
``link.policy``. What the policy blocks becomes a finding at once. The rest goes to
``pipeline.Pipeline``, which returns settled probes; ``judge`` makes each one a finding.
``recorder`` is told of every intent before a frame is sent, and of every finding as soon as it is
made.

The pipeline keeps the robot busy. ``scheduler`` decides what is sent next, ``inflight`` holds what
has no answer yet, ``attempt`` and ``retries`` hold what became of a probe so far.

*What a health check proves.* Every few probes, ``health`` sends an echo with a nonce and a command
that is known to be absent. A robot serves its commands in order; so a check that passes confirms
every answer to what was sent before it, and that what was not answered by then was really not
answered (``confirmation``). A check that fails voids all of that: the robot slept, rebooted or
changed its mode. It is woken (``recovery``) and asked again; a node that does not recover is given
up, and its probes end as inconclusive.

*When silence counts.* A silent probe is sent again until chance does not explain its silence any
more, measured by what the link was seen to lose (``retries.LossEstimate``), each time with a passed
health check behind it. It stays inconclusive where bytes came that may be its answer
(``near_misses``), where its class forbids a retry, and where its node answers no health check. At
the end of a run all silent probes are waited for together (``late_answers``).

*What a dropped link does.* ``session.reconnect`` opens it again to the same robot. Probes that were
in flight are then sent alone (``dropped``): the one that drops the link twice is the suspect and is
not sent a third time. What may have been executed is never sent again.

*What a wrong length proves.* Unknown commands get a length that no command takes. Firmware checks
lengths handler by handler, so each device is measured first: its documented reads and harmless
setters get surplus bytes, and a command that cannot exist shows which answers prove nothing there.
Until two existing commands of a device refused a wrong length, one such probe is in flight. The
first that is accepted was executed (``executions``): it is reported first, and no further wrong
length is sent to that node.
"""
