# SPDX-License-Identifier: Apache-2.0
"""The material models that a fit may work on, as Mitsuba scenes."""
