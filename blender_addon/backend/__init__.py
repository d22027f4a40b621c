# SPDX-License-Identifier: GPL-3.0-or-later
"""The Python that runs the backend: found, installed, tested, chosen in the preferences."""
