# SPDX-License-Identifier: Apache-2.0
"""Measurements that take minutes and write tables into docs/."""
