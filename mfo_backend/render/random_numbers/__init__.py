# SPDX-License-Identifier: Apache-2.0
"""Random numbers of light paths, and points that are more even than random ones."""
