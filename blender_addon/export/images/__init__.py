# SPDX-License-Identifier: GPL-3.0-or-later
"""Pixels of images as linear Rec.709, and headers of picture files."""
