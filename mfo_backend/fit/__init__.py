# SPDX-License-Identifier: Apache-2.0
"""Stages and presets: which loss, from which start, until when."""
