# SPDX-License-Identifier: Apache-2.0
"""How well do the unknown materials of a whole room come out, all at once?"""
