# SPDX-License-Identifier: Apache-2.0
"""Judges: metrics fitted to human observers, run by packages or programs that are optional."""
