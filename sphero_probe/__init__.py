"""Map what a Sphero robot can do, from the terminal or from Python.

Everything that a script needs is here; five lines sweep the built-in robot::

    import asyncio
    import sphero_probe

    async def main():
        async with sphero_probe.connect("fake:bolt-plus") as robot:
            async for finding in robot.sweep(did=0x13):
                print(finding.name, finding.outcome)

    asyncio.run(main())

``sphero_probe.sync`` has the same without ``async``, for notebooks and lessons. ``sphero_probe.errors`` has
the exceptions. The names in ``__all__`` follow semantic versioning; every other module may change at any
time.

Importing this package imports nothing else: each name is loaded when it is used for the first time. Type
checkers read ``__init__.pyi``.
"""

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    """Load a public name when it is used for the first time."""
    from sphero_probe.exports import load  # noqa: PLC0415 - importing this package must import nothing

    value = globals()[name] = load(name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__getattr__("__all__")})  # type: ignore[misc]
