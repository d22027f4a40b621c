# SPDX-License-Identifier: Apache-2.0
"""The sub-commands of `mfo`, a module each, found by its name."""
