# SPDX-License-Identifier: Apache-2.0
"""Do the tests notice when the code is wrong? Faults are put in one at a time and the tests of the same folder run."""
