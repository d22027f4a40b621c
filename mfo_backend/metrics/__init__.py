# SPDX-License-Identifier: Apache-2.0
"""Differences between images, as numbers, maps and gradients. Knows arrays and colour, no renderer and no file."""
