# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures that are shown: as icons of the panel, beside each other in an editor, over the view."""
