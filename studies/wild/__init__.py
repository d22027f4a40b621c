# SPDX-License-Identifier: Apache-2.0
"""Files that nobody here made: what the export reads of them, and what a fit makes of them in Cycles."""
