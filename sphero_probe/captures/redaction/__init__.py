"""Captures without what identifies people and devices. ``copy.redacted`` is the entry point.

What is known to be harmless is kept, what identifies is replaced, everything else is blanked or left out.
``pseudonyms`` says what replaces what. ``hci``, ``advertising``, ``link_layer``, ``att`` and ``frames`` each
handle one layer; ``records`` and ``copy`` apply them to a file.
"""
