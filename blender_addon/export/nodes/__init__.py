# SPDX-License-Identifier: GPL-3.0-or-later
"""Shader node trees: what a socket is linked to, and the shader whose values are fitted."""
