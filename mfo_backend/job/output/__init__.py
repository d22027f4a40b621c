# SPDX-License-Identifier: Apache-2.0
"""What a job writes while it runs and at its end: progress, the terminal bar, result.json."""
