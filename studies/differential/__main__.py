# SPDX-License-Identifier: Apache-2.0
"""What `study.py` compares, as a command.

python -m studies.differential [--scenes 100] [--seed 0] [--size 48] [--samples 64] [--exported]
"""

from .study import main

if __name__ == "__main__":
    main()
