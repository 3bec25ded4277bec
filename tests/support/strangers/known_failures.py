"""What runs on strangers are known to do wrong; a line goes as soon as its check passes."""

KNOWN_FAILURES: dict[str, dict[str, str]] = {
    "setters ignore surplus": {
        "harmless": "node 1 13/01 MOTION 2 times and more; documented, so not to be asked at a wrong length",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
    "setters check the lower bound, rvr": {
        "harmless": "node 1 13/01 MOTION 2 times and more; documented, so not to be asked at a wrong length",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
    "drive ignores surplus": {
        "harmless": "node 2 16/01 MOTION 2 times and more; documented, so not to be asked at a wrong length",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
    "legs ignore surplus": {
        "harmless": "node 1 17/05 MOTION 2 times and more; documented, so not to be asked at a wrong length",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
    "legs ignore surplus, reads too": {
        "harmless": "node 1 17/05 MOTION 2 times and more; documented, so not to be asked at a wrong length",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
    "power ignores surplus": {
        "harmless": "node 1 13/01 MOTION 2 times and more; documented, so not to be asked at a wrong length",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
    "settings ignore surplus": {
        "harmless": "node 1 11/1c PERSIST 2 times; once would do",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
    "some setters ignore surplus": {
        "harmless": "node 2 16/06 WRITE 2 times and more; documented, so not to be asked at a wrong length",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
    "the unknown ignore surplus": {
        "harmless": "node 1 11/1c PERSIST 2 times; once would do",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
    "the unknown of the lamps ignore surplus": {
        "harmless": "node 1 1a/27 WRITE 2 times; once would do",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
    "node 2 ignores surplus but for reads": {
        "harmless": "node 2 16/01 MOTION 2 times and more; documented, so not to be asked at a wrong length",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
    "length after running": {
        "harmless": "node 1 13/01 MOTION 2 times and more; documented, so not to be asked at a wrong length",
    },
    "masks everywhere": {
        "invented": "node 1 11/11: exists (maybe), bad data length (1362 of the kind)",
    },
    "masks in one device": {
        "invented": "node 1 1a/01: exists (certain), bad data length (167 of the kind)",
    },
    "masks in power": {
        "invented": "node 1 13/05: exists (certain), bad data length (231 of the kind)",
    },
    "masks on node 2": {
        "invented": "node 2 11/11: exists (maybe), bad data length (500 of the kind)",
    },
    "stubs": {
        "invented": "node 1 11/02: exists (certain), not yet implemented (174 of the kind)",
    },
    "stubs in one device": {
        "invented": "node 1 1a/01: exists (certain), not yet implemented (188 of the kind)",
    },
    "yes-man": {
        "invented": "node 1 11/02: exists (certain), success (174 of the kind)",
    },
    "restricted": {
        "invented": "node 1 11/02: exists (certain), restricted (170 of the kind)",
    },
    "all restricted": {
        "invented": "node 1 13/02: exists (certain), restricted (98 of the kind)",
    },
    "another node answers": {
        "ends": "it does not end within 600 s",
        "oddity": "it goes on asking",
        "lost": "discovery only: node 1 11/00: silent, and it answered (18 of the kind)",
    },
    "the wildcard answers": {
        "ends": "it does not end within 600 s",
        "oddity": "it goes on asking",
        "lost": "discovery only: node 1 11/00: silent, and it answered (18 of the kind)",
    },
    "device 0 answers": {
        "ends": "it does not end within 600 s",
        "oddity": "it goes on asking",
        "lost": "discovery only: node 1 11/00: silent, and it answered (20 of the kind)",
    },
    "number 0 answers": {
        "ends": "it does not end within 600 s",
        "oddity": "it goes on asking",
        "lost": "discovery only: node 1 11/00: silent, and it answered (20 of the kind)",
    },
    "the next number answers": {
        "ends": "it does not end within 600 s",
        "oddity": "it goes on asking",
        "lost": "discovery only: node 1 11/00: silent, and it answered (19 of the kind)",
    },
    "flags of the request": {
        "oddity": "it does not say what is odd: 'answers nothing'",
    },
    "only errors": {
        "oddity": "it does not say what is odd: 'answers nothing'",
    },
    "one command late by 0.4 s": {
        "lost": "discovery only: node 1 13/17: a documented read, inconclusive",
    },
    "one command late by 0.6 s": {
        "lost": "discovery only: node 1 13/17: a documented read, inconclusive",
    },
    "one command late by 0.9 s": {
        "lost": "discovery only: node 1 13/17: a documented read, inconclusive",
    },
    "one command late by 3.0 s": {
        "lost": "node 1 13/17: silent, and it answered (5 of the kind)",
        "doubt": "node 1 13/33: exists in a device that checks lengths, and was not found (2 of the kind)",
    },
    "everything late": {
        "ends": "discovery only: it does not end within 600 s",
        "doubt": "sweep only: node 2 18/1e: exists in a device that checks lengths, and was not found",
    },
    "no end byte": {
        "lost": "node 1 14/39, which is not there: silent, and it answered (57 of the kind)",
    },
    "bad checksum": {
        "lost": "node 1 14/39, which is not there: silent, and it answered (57 of the kind)",
    },
    "does not escape": {
        "lost": "discovery only: node 1 10/8d, which is not there: silent, and it answered (27 of the kind)",
    },
    "2 kB answer": {
        "errors": "ValueError: payload of 2048 bytes, at most 1024",
    },
    "4 kB answer": {
        "lost": "node 1 11/06: silent, and it answered (2 of the kind)",
    },
    "node 2 sleeps": {
        "lost": "discovery only: node 2 16/29: a documented read, inconclusive (3 of the kind)",
    },
    "node 2 never wakes": {
        "complete": "a part could not be asked, and the run says that it is complete",
    },
    "node 2 dies": {
        "ends": "it does not end within 600 s",
    },
    "changes its mode": {
        "complete": "a part could not be asked, and the run says that it is complete",
    },
    "claims ghosts": {
        "compared": "discovery only: ghost: 11 missing, node 1 1a/3f first",
    },
    "hides commands": {
        "compared": "discovery only: hidden: 4 missing, node 2 16/1b first",
    },
    "hides devices": {
        "compared": "discovery only: hidden: 13 missing, node 1 13/01 first",
    },
    "bb-8 says general error": {
        "invented": "node 1 00/13: exists (certain), general error (16 of the kind)",
    },
    "bb-8 setters ignore surplus": {
        "ends": "it does not end within 600 s",
        "harmless": "node 1 00/22 MOTION; documented, so not to be asked at a wrong length",
        "reported": "what ran is named nowhere, and the run says that it is complete",
        "stops": "probes at a wrong length go on after the first success",
    },
}
