# SPDX-License-Identifier: Apache-2.0
"""`python -m mfo_backend` is the `mfo` command."""

import sys

if sys.version_info < (3, 10):  # noqa: UP036  before anything that an older Python cannot even parse
    sys.stderr.write(
        "mfo: %s is Python %d.%d and the backend needs 3.10 to 3.14: choose another interpreter.\n"  # noqa: UP031
        % (sys.executable, sys.version_info[0], sys.version_info[1])
    )
    sys.exit(3)

from .cli.main import main

if __name__ == "__main__":
    sys.exit(main())
