"""Packed probes read as the probes that were packed."""

import pickle
import tracemalloc
from typing import Final

from hypothesis import given
from hypothesis import strategies as st

from sphero_probe.probing.packed_probes import PackedProbes
from sphero_probe.probing.plan import Probe, sweep
from sphero_probe.protocol.packets import USUAL, Command, SendOptions

BYTES: Final = st.integers(0, 255)
PROBES: Final = st.lists(
    st.builds(
        Probe,
        st.builds(
            Command,
            BYTES,
            BYTES,
            st.binary(max_size=3),
            st.none() | BYTES,
            st.sampled_from([USUAL, SendOptions(answer=False)]),
        ),
        st.booleans(),
    )
)


@given(probes=PROBES, at=st.slices(20))
def test_they_are_the_same_probes(probes: list[Probe], at: slice) -> None:
    packed = PackedProbes(iter(probes))
    assert list(packed) == probes
    assert len(packed) == len(probes)
    assert [packed[place] for place in range(-len(probes), len(probes))] == probes * 2
    assert packed[at] == probes[at]
    assert list(pickle.loads(pickle.dumps(packed))) == probes


def test_every_command_of_a_robot_takes_little_memory() -> None:
    tracemalloc.start()
    try:
        packed = PackedProbes(sweep(range(256), range(256)))
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert list(packed) == list(sweep(range(256), range(256)))
    assert held < 10 * len(packed)
