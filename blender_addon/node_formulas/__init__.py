# SPDX-License-Identifier: GPL-3.0-or-later
"""What does a node make of the numbers that it is given, at each place for itself? As Cycles does, and nothing else."""
