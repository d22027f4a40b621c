# SPDX-License-Identifier: GPL-3.0-or-later
"""The unlinked numbers and colours of the nodes that feed the target: which there are, how far each may go, where it
is kept."""
