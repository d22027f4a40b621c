# SPDX-License-Identifier: GPL-3.0-or-later
"""The reference picture: where it comes from, its colour space and its view."""
