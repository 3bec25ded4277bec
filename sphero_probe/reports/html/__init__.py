"""HTML pages: one file each, which needs no network and no script to be read. ``page`` is the main module.

``page`` writes the frame of a page with its style sheet and script, ``maps`` the pictures of what a node has,
``findings`` the table of results.
"""
