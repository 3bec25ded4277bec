"""Findings to words and pictures: records of the layers below come in, text in the chosen format goes out.

``rows`` makes records JSON-able, ``views`` says which columns a list has, ``registry`` opens a format, and
``printable`` makes harmless what strangers wrote.
"""
