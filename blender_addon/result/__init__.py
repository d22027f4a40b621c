# SPDX-License-Identifier: GPL-3.0-or-later
"""A job's result: read, shown, written onto the material, kept in its history."""
