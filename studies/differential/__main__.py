# SPDX-License-Identifier: Apache-2.0
"""`python -m studies.differential`."""

from .study import main

if __name__ == "__main__":
    main()
