# SPDX-License-Identifier: GPL-3.0-or-later
"""How does a sentence that is made at run time come to be in the user's language?"""
