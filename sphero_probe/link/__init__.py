"""The conversation with one robot. The main class is ``link.Link``: it sends commands and returns exchanges.

``policy.Policy`` decides which commands a link may send; it learns from ``length_checks``.
``tracker.Tracker`` assigns sequence numbers, matches responses to commands and keeps deadlines.
``pacing.Pace`` adapts the timeout and the window of one node. ``requests`` holds a link's queued commands and
those in flight. ``exchange`` has the values that a link returns, ``events`` tells listeners everything that
happens on it, and ``unsolicited`` describes what arrives without being asked for. ``concurrent`` asks several
commands at once.
"""
