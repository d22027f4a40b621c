# SPDX-License-Identifier: GPL-3.0-or-later
"""What stops a fit or will be missed in it, and the buttons that mend it."""
