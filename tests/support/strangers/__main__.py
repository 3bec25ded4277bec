"""Print the failed checks of runs on strangers: ``python -m tests.support.strangers [PART-OF-A-NAME]``."""

import sys

from tests.support.strangers.habits import STRANGERS
from tests.support.strangers.judge import judge
from tests.support.strangers.runs import KINDS, run

_SHOWN = 3
"""Failures of one check that are shown, if no name is given."""

part = sys.argv[1] if sys.argv[1:] else ""
for stranger in STRANGERS:
    if part not in stranger.name:
        continue
    sys.stdout.write(f"{stranger.name}: {stranger.habit}\n")
    for kind in KINDS:
        ran = run(stranger, kind)
        sys.stdout.write(f"  {kind}: {ran.seconds:.1f} s, {len(ran.robot.heard)} requests heard\n")
        for check, failures in judge([ran]).items():
            for failure in failures if part else failures[:_SHOWN]:
                sys.stdout.write(f"    {check}: {failure}\n")
            if not part and len(failures) > _SHOWN:
                sys.stdout.write(f"    {check}: … {len(failures) - _SHOWN} more\n")
