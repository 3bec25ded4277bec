"""Print what runs on strangers do wrong: ``python -m tests.support.strangers [PART-OF-A-NAME]``."""

import sys

from tests.support.strangers.habits import STRANGERS
from tests.support.strangers.judge import judge
from tests.support.strangers.runs import KINDS, run

_SHOWN = 3
"""Offences of one check that are shown, where no name was given."""

part = sys.argv[1] if sys.argv[1:] else ""
for stranger in STRANGERS:
    if part not in stranger.name:
        continue
    sys.stdout.write(f"{stranger.name}: {stranger.habit}\n")
    for kind in KINDS:
        ran = run(stranger, kind)
        sys.stdout.write(f"  {kind}: {ran.seconds:.1f} s, {len(ran.robot.heard)} requests heard\n")
        for check, offences in judge([ran]).items():
            for offence in offences if part else offences[:_SHOWN]:
                sys.stdout.write(f"    {check}: {offence}\n")
            if not part and len(offences) > _SHOWN:
                sys.stdout.write(f"    {check}: … {len(offences) - _SHOWN} more\n")
