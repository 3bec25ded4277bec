"""Renders the records of the layers below as text in the chosen format.

``rows`` makes records JSON-able, ``views`` says which columns a list has, ``registry`` opens a format, and
``printable`` makes text from robots and files harmless.
"""
