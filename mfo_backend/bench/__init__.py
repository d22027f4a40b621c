# SPDX-License-Identifier: Apache-2.0
"""The benchmark: random scenes, methods side by side, rows of time and error, and their report."""
