# SPDX-License-Identifier: Apache-2.0
"""What Mitsuba loads of ours: materials and a texture."""
