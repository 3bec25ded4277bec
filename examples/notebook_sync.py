"""Use the API without async, as in a notebook: each block could be a cell."""

import sys

import sphero_probe.sync

with sphero_probe.sync.connect(sys.argv[1] if sys.argv[1:] else "fake:bolt-plus") as robot:
    print(robot.name, robot.model and robot.model.name, robot.firmware())

    print(robot.send("power.get_battery_percentage").percentage, "%")

    robot.set_led("front", "ff8000")

    for finding in robot.sweep(did="power", cid=range(0x20)):
        if finding.fields:
            print(finding.name, finding.fields)
