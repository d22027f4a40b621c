# SPDX-License-Identifier: Apache-2.0
"""Principled models: parameter tables, evaluation, mappings."""
