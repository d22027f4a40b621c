# SPDX-License-Identifier: Apache-2.0
"""Random scenes by Cycles and by Mitsuba, as a command.

    python -m studies.differential [--scenes 100] [--seed 0] [--size 48] [--samples 64] [--exported]
        [--groups material light shape]

`study.py` says what is compared.
"""

from .study import main

if __name__ == "__main__":
    main()
