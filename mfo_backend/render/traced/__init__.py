# SPDX-License-Identifier: Apache-2.0
"""Whole light paths over the target with derivatives by the values of its material."""
