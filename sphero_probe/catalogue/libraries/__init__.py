"""What other libraries know of the robots. Their source is read, and never run.

``finding.find_library`` is the entry. ``source`` finds and parses the files; ``spherov2`` and ``rvr_sdk``
know how these two libraries write down their commands; ``comparison`` compares a library with the catalogue.
"""
